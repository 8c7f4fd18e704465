#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <tandem/problem/lanes.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/problem/symmetric_pattern.hpp>

namespace tandem {

/// Row and column of each nonzero of the constraint Jacobian. A pair may occur twice; its values then add up.
struct TripletPattern {
  std::vector<int> row, column;
};

/// Where soft bounds stand in a Program, Outside without a loss and with independent noise: in the cost, as all soft blocks;
/// or as rows beside the hard ones, for solvers whose model of the cost is to know of a bound before it is reached.
enum class SoftBounds { in_cost, as_rows };

/// A problem as solvers see it: rows, bounds and fixed patterns in tangent coordinates, X = X̄ ⊕ δ with X̄ the
/// variables' values, never residuals or groups. Compiled once; the problem must outlive it. Evaluation does not
/// allocate. Each Program of a problem has its own point, while X̄ is the problem's. Throws Error where a residual is
/// undefined at the point, where variables or blocks have joined or left or were fixed since it was made, or a soft bound
/// that is a row has got a loss, and where another one, or set_value(), has changed X̄: until the next reset().
class Program {
 public:
  /// Of the Hessian's pattern, which has the variables' order, another one that has all of its blocks, and in which the values are
  /// to stand: in_order_of_elimination() of solvers/linear.
  using HessianLayout = SymmetricPattern (*)(const SymmetricPattern&);

  /// Throws Error when the problem has no free variable.
  explicit Program(Problem& problem, SoftBounds soft_bounds = SoftBounds::in_cost, HessianLayout layout = nullptr);
  ~Program();

  /// Threads that evaluate, at most; 0, the default: one each core. No result depends on it. Throws Error below zero.
  void use_threads(int threads) { lanes_.use_threads(threads); }
  const detail::Lanes& lanes() const { return lanes_; }

  /// Whether the problem's variables and blocks are those that it was compiled for.
  bool is_current() const;

  int num_unknowns() const { return hessian_.size(); }
  int num_rows() const { return static_cast<int>(lower_.size()); }
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  const SymmetricPattern& hessian_pattern() const { return hessian_; }
  const TripletPattern& jacobian_pattern() const { return jacobian_; }
  /// With SoftBounds::as_rows, of each row: w = 1/σ² of a soft bound, 0 of a hard one.
  const Eigen::VectorXd& soft_weights() const { return soft_weights_; }
  /// The Hessian's block that a variable is, −1 when it is fixed. Blocks are in the order in which the variables were
  /// added to the problem.
  int block_of(int variable_id) const { return block_of_variable_[std::size_t(variable_id)]; }

  /// The point becomes X̄ ⊕ δ.
  void move_to(const Eigen::VectorXd& delta);
  /// X̄ becomes the point: δ = 0 there from now on.
  void recenter();
  /// The point becomes X̄.
  void reset();
  /// Remembers X̄, and makes it what was remembered last.
  void keep();
  void restore();
  /// The largest angle between X̄ and the point [rad]. Above some 1 rad, solvers that move δ far recenter and restart,
  /// so that no chart is left.
  double largest_angle() const;

  /// All at the point, with respect to δ. Of soft bounds that are rows the cost is ½ w d² of the distance d outside, which
  /// cost() and what is with it do not have.
  double cost();
  double cost_of_rows(const Eigen::VectorXd& c) const;
  double gradient(Eigen::VectorXd& gradient);
  /// Cost, gradient and the Gauss-Newton Hessian's values in the order of its pattern.
  double linearize(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian);
  /// Both with respect to right perturbations of the point, as if it had been recentred.
  double gradient_at_point(Eigen::VectorXd& gradient);
  double linearize_at_point(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian);
  void constraints(Eigen::VectorXd& c);
  void constraint_jacobian(Eigen::VectorXd& values);
  /// Both in one evaluation.
  void linearize_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian);
  /// The same with respect to right perturbations of the point, as if it had been recentred.
  void linearize_constraints_at_point(Eigen::VectorXd& c, Eigen::VectorXd& jacobian);
  /// Adds Jᵀ diag(weights) J to a Hessian, J as constraint_jacobian() gave it, wherever the point is now; weights not
  /// below zero.
  void add_constraint_hessian(const Eigen::VectorXd& weights, const Eigen::VectorXd& jacobian,
                              Eigen::VectorXd& hessian) const;
  /// The exact Hessian of factor·cost + multipliersᵀ c: in closed form where residuals give their second derivatives, by
  /// central differences of the closed-form gradient of those that do not.
  void exact_hessian(double factor, const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian);
  /// What the Gauss-Newton Hessian, as linearize() gives it, lacks of the exact one of cost + multipliersᵀ c.
  void curvature(const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian);

  /// Those of the problem's hard blocks (Problem::multipliers), one a row; 0 of soft bounds.
  void multipliers(Eigen::VectorXd& y) const;
  void set_multipliers(const Eigen::VectorXd& y);

  /// Largest distance of c outside its hard bounds, and its row (−1: none outside).
  struct Violation {
    double size;
    int row;
  };
  Violation violation(const Eigen::VectorXd& c) const;
  /// The same over the rows that read fixed variables alone. Solvers cannot change them: their bounds are infinite in
  /// lower() and upper().
  Violation fixed_violation(const Eigen::VectorXd& c) const;

  /// "twist components of target 12, target 13": the block that constraint row belongs to.
  std::string describe_row(int row) const;
  /// ‖W J v‖² over all soft residuals and the given weights' hard rows, and ‖W J diag(v)‖² as its scale: how much the
  /// point's cost notices a step along v, and how much it would if no two entries made up for each other.
  struct Stiffness {
    double along, scale;
  };
  Stiffness stiffness(const Eigen::VectorXd& v, const Eigen::VectorXd& row_weights);
  /// The block whose cost or gradient is not finite at the point; empty when all are.
  std::string describe_bad_block();
  /// The first block that is not smooth within 1e-6 of X̄ along a direction by δ: whose residual jumps, as that of a
  /// rotation does at π, or changes otherwise than its Jacobian says. Leaves the point at X̄.
  struct Doubt {
    enum class Kind { none, jump, jacobian } kind = Kind::none;
    std::string block;  ///< as describe_row() has it
  };
  Doubt doubt(const Eigen::VectorXd& direction);
  /// The variable that an unknown belongs to, and which direction of it: "x", "rotation about z", "heading", …
  struct Unknown {
    std::string variable;
    int entry;  ///< of the variable's tangent
    std::string direction;
  };
  Unknown describe_unknown(int unknown) const;

 private:
  void compile_hessian();
  void compile_places();
  void choose_rows(SoftBounds soft_bounds);
  void compile_constraints();
  void read_bounds();
  void read_soft_bounds(std::size_t pool);
  void compile_lanes();
  detail::HessianPlace place(int block_a, int block_b) const;
  void check_unchanged() const;
  const detail::PoolBase& pool(std::size_t p) const;  // whichever of the two it is
  void take_point();
  void chart_if_moved();
  void leave_charts();
  double accumulate(Eigen::VectorXd& gradient, Eigen::VectorXd* hessian);
  void second_derivatives(detail::Curvature wanted, double factor, const Eigen::VectorXd& multipliers,
                          Eigen::VectorXd& hessian);
  void evaluate_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian);
  /// Runs f(p, begin, end) of every pool's blocks, by their order of evaluation; the sum of what it returns. Blocks of
  /// several lanes, which may run at once, have no unknown in common, nor an entry of the Hessian.
  template <class F>
  double over_blocks(F f) const;
  /// The same; each lane calls begin(lane) before.
  template <class F, class Begin>
  double over_blocks(F f, Begin begin) const;
  template <class F>
  double over_hard_blocks(F f) const;
  /// Runs f(store, begin, end) of all states, in lanes.
  template <class F>
  void over_states(F f);
  /// The same; each lane calls begin(lane) before.
  template <class F, class Begin>
  void over_states(F f, Begin begin);
  /// A lane's own blocks of the Hessian, first and end; its unknowns, first and number.
  std::pair<int, int> blocks_of(int lane) const;
  std::pair<int, int> unknowns_of(int lane) const;
  void set_zero_part(int lane, Eigen::VectorXd& hessian) const;  // what a lane's own blocks write

  Problem& problem_;
  std::vector<int> offset_;             // of each variable, −1 when fixed
  std::vector<int> block_of_variable_;  // the same
  std::vector<int> variable_of_block_;  // ids of the free variables, in order
  std::vector<detail::PoolPlacement> placement_;
  std::vector<const detail::SoftPoolBase*> costs_;                  // of each pool, null where it is rows
  std::vector<const detail::HardPoolBase*> rows_;                   // of each pool, null where it is a cost
  std::vector<std::unique_ptr<detail::HardPoolBase>> soft_bounds_;  // of each pool, those that are rows
  std::vector<int> first_row_;                                      // of each pool's rows
  SymmetricPattern hessian_;
  TripletPattern jacobian_;
  Eigen::VectorXd lower_, upper_, soft_weights_;
  struct FixedRow {
    int row;
    double lower, upper;
  };
  std::vector<FixedRow> fixed_rows_;
  // Each lane has the blocks that read unknowns of its own part of them alone, and so writes its own part of the solver's
  // arrays; those that read unknowns of several come after all lanes. One lane for small problems.
  detail::Lanes lanes_;
  int num_lanes_ = 1;
  std::vector<int> first_of_lane_;  // of each pool, the lanes' first blocks, then those of several parts, then the end
  Eigen::VectorXd point_gradient_;  // of second_derivatives()
  Eigen::VectorXd delta_;           // the point, against X̄
  long long revision_, value_revision_, bounds_revision_;
  bool moved_ = false;  // since the charts were last computed
};

}  // namespace tandem
