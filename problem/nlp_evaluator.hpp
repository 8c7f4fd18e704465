#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/problem/symmetric_pattern.hpp>

namespace tandem {

/// Sparsity pattern of the constraint Jacobian: row and column of each value. If a (row, column) pair occurs twice, its
/// values add up.
struct TripletPattern {
  std::vector<int> row, column;
};

/// How an NlpEvaluator treats soft bounds, that is SoftBound blocks without a robust loss and with independent noise.
enum class SoftBoundRole {
  in_cost,  ///< part of the cost, like all soft blocks
  as_rows   ///< constraint rows, so that a solver can anticipate a bound that the point has not reached yet
};

/// Evaluates a Problem for a solver: cost, constraints and their derivatives, as plain vectors with fixed sparsity
/// patterns. Groups and residual types are hidden.
///
///   minimize f(δ)   subject to   lower ≤ c(δ) ≤ upper,   X = X̄ ⊕ δ
///
/// The centre X̄ are the values stored in the problem. The unknowns δ are the tangent coordinates of the free variables
/// at X̄, in the order in which the variables were added. The point X is where the evaluator evaluates. Initially δ =
/// 0.
///
///   NlpEvaluator nlp(problem);
///   Eigen::VectorXd gradient(nlp.num_unknowns()), hessian(nlp.hessian_pattern().nonzeros());
///   nlp.move_to(delta);                                    // X = X̄ ⊕ δ
///   const double cost = nlp.linearize(gradient, hessian);  // at X; derivatives with respect to δ
///   nlp.recenter();                                        // accepts the point: X̄ = X, δ = 0
///
/// The constructor computes all patterns; evaluation does not allocate. Vectors must be passed with their final size:
/// num_unknowns() for δ and gradients, num_rows() for c and multipliers, hessian_pattern().nonzeros() for Hessians,
/// jacobian_pattern().row.size() for Jacobians. Results are bitwise independent of the number of threads.
///
/// The problem must outlive the evaluator and must not be moved. Several evaluators of one problem have separate points
/// but share X̄. Neither they nor their problem may be used from several threads at once.
///
/// Methods that read the problem, its point or its blocks throw in these cases:
/// - UndefinedResidualError: a residual is undefined at the point.
/// - StaleHandleError: the structure of the problem changed (see is_current()). Make a new evaluator.
/// - StaleHandleError: Problem::set_value() or another evaluator changed X̄. Call reset() first.
class NlpEvaluator {
 public:
  /// Function that maps the natural pattern of the Hessian, with the variables in the order of δ, to a pattern in
  /// another memory layout. The result must have all blocks of the natural pattern and may have more. Example:
  /// in_elimination_order() of solvers/linear.
  using HessianLayout = SymmetricPattern (*)(const SymmetricPattern&);

  /// Computes all patterns. If `layout` is not null, it determines the pattern of the Hessian. Throws BadInputError if
  /// the problem has no free variable.
  explicit NlpEvaluator(Problem& problem, SoftBoundRole soft_bounds = SoftBoundRole::in_cost,
                        HessianLayout layout = nullptr);
  ~NlpEvaluator();

  /// Limits the number of threads for evaluation; 0, the default, uses one per core. Throws BadInputError if negative.
  void use_threads(int threads) { task_runner_.use_threads(threads); }
  const detail::TaskRunner& tasks() const { return task_runner_; }

  /// Returns whether the structure of the problem is unchanged since construction. It changes if a variable or block is
  /// added, removed, fixed or freed, or if other contents are moved into the problem. It also changes if a soft bound
  /// that is a row gets a loss or correlated noise.
  bool is_current() const;

  /// Returns the size of δ: the sum of the tangent dimensions of the free variables.
  int num_unknowns() const { return hessian_.size(); }
  /// Returns the number of constraint rows.
  int num_rows() const { return static_cast<int>(lower_.size()); }
  /// Return the bounds of the rows, ±infinity if unbounded. See also fixed_violation().
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  const SymmetricPattern& hessian_pattern() const { return hessian_; }
  const TripletPattern& jacobian_pattern() const { return jacobian_; }
  /// Returns the weight 1/σ² of each row that is a soft bound, and 0 for each hard row.
  const Eigen::VectorXd& soft_weights() const { return soft_weights_; }
  /// Returns which block of unknowns belongs to a variable, −1 if the variable is fixed. Blocks are numbered in the
  /// order in which the variables were added; hessian_pattern().first gives their first unknowns.
  int block_of(int variable_id) const { return block_of_variable_[std::size_t(variable_id)]; }

  /// Sets the point to X̄ ⊕ δ. The values stored in the problem do not change.
  void move_to(const Eigen::VectorXd& delta);
  /// Sets X̄ to the point and δ to 0, which changes the values stored in the problem.
  void recenter();
  /// Sets the point to X̄. Takes over values and bounds that were changed in the problem.
  void reset();
  /// save() stores a copy of X̄. restore() sets X̄ and the point to this copy.
  void save();
  void restore();
  /// Returns the largest rotation angle between X̄ and the point [rad]. A solver should call recenter() when it exceeds
  /// about 1 rad, to stay well inside the domain of the tangent coordinates.
  double largest_angle() const;

  // Evaluation at the point. Derivatives are with respect to δ, except in the methods ..._at_point(). Those are with
  // respect to right perturbations of the point, and return what the plain methods return after recenter().

  /// Returns the cost f, without the soft bounds that are rows.
  double cost();
  /// Returns the cost ½ Σ w d² of the soft bounds that are rows. w are the soft_weights(), d is the distance of the row
  /// c outside its bounds.
  double cost_of_rows(const Eigen::VectorXd& c) const;
  /// Sets the gradient of f and returns f.
  double gradient(Eigen::VectorXd& gradient);
  /// Sets the gradient of f and the values of its Gauss-Newton Hessian in the order of hessian_pattern(). Returns f.
  double linearize(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian);
  double gradient_at_point(Eigen::VectorXd& gradient);
  double linearize_at_point(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian);
  /// Sets the constraint rows c.
  void constraints(Eigen::VectorXd& c);
  /// Sets the values of ∂c/∂δ in the order of jacobian_pattern().
  void constraint_jacobian(Eigen::VectorXd& values);
  /// Sets c and its Jacobian in one evaluation.
  void linearize_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian);
  void linearize_constraints_at_point(Eigen::VectorXd& c, Eigen::VectorXd& jacobian);
  /// Adds Jᵀ diag(weights) J to a Hessian. `jacobian` has values from constraint_jacobian(), from this point or another
  /// one. The weights, one per row, must not be negative.
  void add_constraint_hessian(const Eigen::VectorXd& weights, const Eigen::VectorXd& jacobian,
                              Eigen::VectorXd& hessian) const;
  /// Sets `hessian` to the exact Hessian of factor·f + multipliersᵀ c. It is in closed form for residuals that
  /// implement second derivatives. For others it uses central differences of the closed-form gradient.
  void exact_hessian(double factor, const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian);
  /// Sets `hessian` to the exact Hessian of f + multipliersᵀ c minus the Gauss-Newton Hessian of linearize().
  void curvature(const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian);
  /// Returns whether the exact Hessian of f takes no longer than a few linearisations: all or most residuals implement
  /// second derivatives, and the others are no calls to a scripting language.
  bool has_cheap_curvature() const;

  /// Read and store the multipliers of the hard blocks (Problem::multipliers), one per row. Rows of soft bounds read as
  /// 0 and are not stored.
  void multipliers(Eigen::VectorXd& y) const;
  void set_multipliers(const Eigen::VectorXd& y);

  /// Largest violation of the bounds: the distance outside [units of the row] and the row, −1 if none is violated.
  struct Violation {
    double size;
    int row;
  };
  /// Returns the largest violation over the hard rows. A row that is not finite is violated by infinity.
  Violation violation(const Eigen::VectorXd& c) const;
  /// Sets the magnitude Σⱼ |Jᵢⱼ| |xⱼ| of each row's terms, to first order, from its Jacobian at X̄. The rounding error of
  /// a row is a small multiple of this magnitude times the resolution of doubles. |xⱼ| is an entry of a vector, 1 for a
  /// rotation, and the norm of the other coordinates in a group with rotations.
  void row_magnitudes(const Eigen::VectorXd& jacobian, Eigen::VectorXd& magnitudes) const;
  /// Returns the largest violation over the hard rows that read only fixed variables. Solvers cannot influence them, so
  /// lower() and upper() are infinite there.
  Violation fixed_violation(const Eigen::VectorXd& c) const;

  /// Returns the block that a constraint row belongs to, for example "twist components of target 12, target 13".
  std::string describe_row(int row) const;
  /// Curvature of the Gauss-Newton model along a direction v, from the Jacobians J and the weights W of all blocks. If
  /// `along` is much smaller than `scale`, the residuals do not observe v.
  struct Stiffness {
    double along;  ///< ‖W J v‖²
    double scale;  ///< ‖W J diag(v)‖²: the same without cancellation between the entries of v
  };
  /// Returns the curvature along `v`. W² of soft blocks follows from noise and loss; of constraint rows it is
  /// `row_weights`, which must not be negative.
  Stiffness stiffness(const Eigen::VectorXd& v, const Eigen::VectorXd& row_weights);
  /// Returns the first soft block whose cost or gradient is not finite at the point, empty if there is none.
  std::string describe_nonfinite_block();
  /// Result of check_derivatives(): the kind of defect and the block that has it.
  struct DerivativeCheck {
    enum class Kind {
      none,
      jump,     ///< the residual is discontinuous, e.g. the logarithm of a rotation at π
      jacobian  ///< the Jacobian contradicts finite differences
    } kind = Kind::none;
    std::string block;  ///< named as by describe_row()
  };
  /// Compares all residuals with their Jacobians by finite differences within 1e-6 of X̄ along `direction`. Returns the
  /// first block that jumps, else the first block with a wrong Jacobian. Sets the point to X̄.
  DerivativeCheck check_derivatives(const Eigen::VectorXd& direction);
  /// Description of an unknown for messages.
  struct Unknown {
    std::string variable;
    int entry;              ///< index in the tangent of the variable
    std::string direction;  ///< "x", "rotation about z", "heading", …
  };
  /// Returns the variable and the direction of an unknown, an index of δ.
  Unknown describe_unknown(int unknown) const;

 private:
  void compile_hessian();
  void compile_places();
  void choose_rows(SoftBoundRole soft_bounds);
  void compile_constraints();
  void read_bounds();
  void read_soft_bounds(std::size_t pool);
  void compile_tasks();
  detail::HessianPlace place(int block_a, int block_b) const;
  void check_unchanged() const;
  const detail::PoolBase& pool(std::size_t p) const;  // the cost pool or the constraint pool
  void claim_point();                                 // makes the state stores hold the point of this evaluator
  void update_charts();                               // later derivatives are with respect to δ
  void drop_charts();                                 // … with respect to perturbations of the point
  double accumulate(Eigen::VectorXd& gradient, Eigen::VectorXd* hessian);
  void second_derivatives(detail::Curvature wanted, double factor, const Eigen::VectorXd& multipliers,
                          Eigen::VectorXd& hessian);
  void evaluate_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian);
  /// Calls f(p, begin, end) for ranges of the blocks of every pool p, in the order of evaluation, and returns the sum
  /// of the results. Blocks of different tasks share no unknown and no entry of the Hessian, so tasks may run
  /// concurrently.
  template <class F>
  double over_blocks(F f) const;
  /// Evaluates the blocks that only one thread may evaluate.
  void prepare(bool jacobians) const;
  /// Also calls begin(task) at the start of each task.
  template <class F, class Begin>
  double over_blocks(F f, Begin begin) const;
  template <class F>
  double over_hard_blocks(F f) const;
  /// Calls f(store, begin, end) for ranges of the states of every store, in tasks.
  template <class F>
  void over_states(F f);
  /// Also calls begin(task) at the start of each task.
  template <class F, class Begin>
  void over_states(F f, Begin begin);
  std::pair<int, int> blocks_of(int task) const;    // first and end of the Hessian's block columns of a task
  std::pair<int, int> unknowns_of(int task) const;  // first and number of the unknowns of a task
  void set_zero_part(int task, Eigen::VectorXd& hessian) const;  // the block columns of a task

  Problem& problem_;
  std::vector<int> offset_;             // first unknown of each variable, −1 if fixed
  std::vector<int> block_of_variable_;  // block of each variable, −1 if fixed
  std::vector<int> variable_of_block_;  // IDs of the free variables, in the order of the unknowns
  std::vector<detail::PoolPlacement> placement_;
  std::vector<const detail::SoftPoolBase*> costs_;  // Per pool; null if the pool is evaluated as rows.
  std::vector<const detail::HardPoolBase*> rows_;   // Per pool; null if the pool is evaluated as a cost.
  std::vector<std::unique_ptr<detail::HardPoolBase>> soft_bounds_;  // Null unless it has soft bounds as rows.
  std::vector<int> first_row_;                                      // First constraint row of each pool.
  SymmetricPattern hessian_;
  TripletPattern jacobian_;
  Eigen::VectorXd lower_, upper_, soft_weights_;
  struct FixedRow {
    int row;
    double lower, upper;
  };
  std::vector<FixedRow> fixed_rows_;
  // The unknowns are divided into consecutive parts, one per task. A task evaluates the blocks that read unknowns of
  // its part only, and writes only its part of the output. Blocks that read several parts are evaluated after all
  // tasks. Small problems have one task.
  detail::TaskRunner task_runner_;
  int num_tasks_ = 1;
  std::vector<int> first_of_task_;  // per pool: first block of each task, first block of several parts, end
  Eigen::VectorXd point_gradient_;  // scratch of second_derivatives()
  Eigen::VectorXd delta_;           // the point relative to X̄
  std::uint64_t serial_;            // serial number of the problem
  long long revision_, value_revision_, bounds_revision_;
  bool moved_ = false;  // whether the point has moved since the charts were computed
};

}  // namespace tandem
