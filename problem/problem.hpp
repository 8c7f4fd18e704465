#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <typeindex>
#include <utility>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/problem/handles.hpp>
#include <tandem/problem/hard_pool.hpp>
#include <tandem/problem/residual_type.hpp>
#include <tandem/problem/weighted_pool.hpp>

namespace tandem {

class NlpEvaluator;
class Subproblem;

namespace detail {
struct AnchoredState;
class ProblemData;
struct LinearRows;
/// Returns a number that no other Problem of the process has.
std::uint64_t new_problem_serial();
}  // namespace detail

/// A nonlinear least-squares problem with constraints, whose variables live on Lie groups:
///
///   minimize ½ Σ ρ(rᵀ Σ⁻¹ r)   subject to   lower ≤ r ≤ upper
///
/// A residual r has a fixed number of rows and reads one or more variables. It joins the problem as a block. A soft
/// block, added by minimize(), is a cost with a noise covariance Σ and an optional robust loss ρ. A hard block, added
/// by subject_to(), is a constraint with bounds. One residual type serves both roles.
///
///   Problem problem;
///   const auto x0 = problem.add(SE3(), "x0"), x1 = problem.add(initial_guess, "x1");
///   problem.minimize(Prior<SE3>{SE3()}, Gaussian(prior_sigmas), {x0});
///   problem.minimize(RelativePose<SE3>{odometry}, Gaussian(odometry_sigmas), {x0, x1}, Cauchy(2.0));
///   problem.subject_to(TwistComponents<SE3, sway | heave>{dt}, equal_to(0), {x0, x1});
///   const Summary summary = solve(problem, AugmentedLagrangianOptions{});
///   const SE3 estimate = problem.value(x1);
///
/// A solver starts at the values of the variables and replaces them by the best point that it found.
/// A handle is invalid after its variable or block was removed, and in other problems. Every function with a handle
/// throws StaleHandleError, naming the variable or the residual, if the handle is invalid. Functions with other
/// arguments throw BadInputError if these are invalid. A function that throws changes nothing.
///
/// Memory of removed variables and blocks is reused, so a sliding window runs in constant memory.
/// Thread safety: different problems may be used in different threads, and const functions of one problem concurrently.
/// Exceptions: functions that evaluate residuals (weight, linearization, convex_loss_scale) are not concurrent for a
/// problem with a marginal prior, which has scratch memory.
class Problem {
 public:
  Problem() = default;
  /// Move and swap contents. Handles, blocks and IDs follow the contents. If an assignment replaces contents, their
  /// handles become invalid. A moved-from problem is empty and can be used again. An NlpEvaluator or a Subproblem of
  /// either problem is no longer valid.
  Problem(Problem&& other) noexcept { swap(other); }
  Problem& operator=(Problem&& other) noexcept {
    Problem taken(std::move(other));
    swap(taken);
    return *this;
  }
  void swap(Problem& other) noexcept;
  friend void swap(Problem& a, Problem& b) noexcept { a.swap(b); }
  /// Returns an independent copy. Solving it gives bitwise the same result. Block handles and variable IDs are valid in
  /// both problems. A Variable handle belongs to one problem only; see counterpart().
  Problem copy() const;
  /// Returns the handle, in this problem, of a variable `x` of another problem. One of the two problems must be a copy
  /// of the other, or both of a third. Throws StaleHandleError if this problem has no such variable.
  template <LieGroup G>
  Variable<G> counterpart(const Variable<G>& x) const {
    check_counterpart(x);
    Variable<G> own = x;
    own.problem = serial_;
    return own;
  }
  /// Returns the handle of the block that was added by the same call as `block` to another problem, if both problems
  /// were built by the same sequence of calls. Throws StaleHandleError if there is none.
  Block counterpart(const Block& block) const;

  /// Adds a free variable with the value `initial`, the initial guess of the next solve. `name` is used in messages;
  /// the default is "variable N".
  template <LieGroup G>
  Variable<G> add(const G& initial, std::string name = {}) {
    auto& states = store<G>();
    const int id = new_variable_id();
    return Variable<G>(new_variable(id, states, states.add(initial, id, variable_name(std::move(name)))));
  }
  /// Removes a variable and invalidates its handles. Its ID may be reused. Throws BadInputError, naming the variable,
  /// if a block still reads it.
  void remove(const VariableHandle& x) { remove_variable(id(x)); }
  /// Returns whether `x` is a variable of this problem that has not been removed.
  bool has(const VariableHandle& x) const { return x.problem == serial_ && ids_.is_current(x.slot, x.generation); }
  /// Returns the value of a variable: its initial guess, or the result of the last solve.
  template <LieGroup G>
  const G& value(const Variable<G>& x) const {
    const VariableInfo& variable = variables_[std::size_t(id(x))];
    return static_cast<const detail::StateStore<G>*>(variable.store)->value[std::size_t(variable.slot)];
  }
  template <LieGroup G>
  void set_value(const Variable<G>& x, const G& value) {
    const VariableInfo& variable = variables_[std::size_t(id(x))];
    auto& states = *static_cast<detail::StateStore<G>*>(variable.store);
    states.value[std::size_t(variable.slot)] = states.point[std::size_t(variable.slot)] = value;
    ++value_revision_;
  }
  /// Fixes a variable at its value, or frees it if `fixed` is false. Solvers treat a fixed variable as a constant.
  void fix(const VariableHandle& x, bool fixed = true) {
    variables_[std::size_t(id(x))].fixed = fixed;
    ++revision_;
  }
  bool is_fixed(const VariableHandle& x) const { return variables_[std::size_t(id(x))].fixed; }

  /// Adds the cost ½ ρ(rᵀ Σ⁻¹ r) of a residual that reads the variables `x`; `noise` is Σ and `loss` is ρ. A variable
  /// may occur several times in `x`; derivatives then add up. Throws BadInputError if the dimension of the noise is not
  /// R::dim, or if the scale of the loss is not positive.
  template <Residual R>
  Block minimize(const R& residual, const Gaussian& noise, const VariablesOf<R>& x, const Loss& loss = {}) {
    return add_soft(type_of<R, false>(), &residual, slots<R>(x).data(), noise, loss);
  }

  /// Adds the constraint lower ≤ r ≤ upper, in the units of the residual. A row may be unbounded on one or both sides
  /// (±infinity). Throws BadInputError if a lower bound exceeds its upper bound, if a bound is NaN, or if no finite
  /// number lies between the bounds.
  template <Residual R>
  Block subject_to(const R& residual, const Bounds<R::dim>& bounds, const VariablesOf<R>& x) {
    return add_hard(type_of<R, true>(), &residual, slots<R>(x).data(), bounds.lower.data(), bounds.upper.data());
  }

  /// Add a block whose residual type is known at run time only; `residual` points to an object of that type. Both also
  /// throw BadInputError if the number of variables, of bounds or the group of a variable is wrong.
  Block minimize(const detail::ResidualType& type, const void* residual, std::span<const VariableHandle> x,
                 const Gaussian& noise, const Loss& loss = {});
  Block subject_to(const detail::ResidualType& type, const void* residual, std::span<const VariableHandle> x,
                   std::span<const double> lower, std::span<const double> upper);

  void remove(const Block& block);
  /// Returns whether `block` is a block of this problem that has not been removed.
  bool has(const Block& block) const;

  /// Marginalises variables. Replaces all blocks that read any of them by one prior on the other free variables that
  /// these blocks read and, if hard blocks imply one, by one constraint on them. Then removes the variables. Earlier
  /// marginal priors and constraints are merged into the new ones. The prior
  ///
  ///   ½‖A (X ⊖ X̄) + b‖² + c
  ///
  /// is the Schur complement of the Gauss-Newton model of these blocks at the current values X̄, in the tangent space
  /// of right perturbations. Robust losses enter with their weight ρ' at X̄. The constant c keeps costs before and
  /// after comparable. The prior is exact if the residuals are linear. Otherwise it loses accuracy as the estimate
  /// moves away from X̄, because X̄ and A stay fixed.
  ///
  /// Hard rows enter by null-space elimination (detail::eliminate). A row is active if it is an equality, or if its
  /// multiplier is not zero. It then counts as an equality at its active bound. The equations that active rows imply
  /// for the remaining variables alone become the marginal constraint A (X ⊖ X̄) + b = 0. Inactive inequalities are
  /// removed without effect. The result is exact if the active rows are linear and are active in the solution of all
  /// data. Unobservable directions of the removed variables contribute nothing; information below about 1e-13 of that
  /// of the blocks is dropped. Fixed variables count as constants; free those to be estimated before. Invalidates
  /// NlpEvaluators of this problem. Throws and changes nothing if an ID is repeated (BadInputError) or unknown
  /// (StaleHandleError), or if a residual is undefined or infinite (UndefinedResidualError).
  void marginalize(std::span<const int> variable_ids);
  template <LieGroup... Gs>
  void marginalize(const Variable<Gs>&... x) {
    marginalize(std::array<int, sizeof...(Gs)>{id(x)...});
  }
  /// Return the prior and the constraint that marginalize() created, or nothing if there is none.
  std::optional<Block> marginal_prior() const;
  std::optional<Block> marginal_constraint() const;

  /// Returns the weight ρ'(s) that the robust loss gives a soft block at the current values; 1 without a loss. Throws
  /// BadInputError for a hard block.
  double weight(const Block& block) const;
  /// Return and replace the noise of a soft block. An NlpEvaluator stays valid, unless the block is one of its
  /// constraint rows (SoftBoundRole::as_rows) and the new noise is correlated. Both throw BadInputError for a hard
  /// block; set_noise() also if the number of rows differs.
  Gaussian noise(const Block& block) const;
  void set_noise(const Block& block, const Gaussian& noise);
  /// Return and replace the robust loss of a soft block, as given, without loss_scale(). An NlpEvaluator stays valid,
  /// unless the block is one of its constraint rows. Both throw BadInputError for a hard block; set_loss() also if the
  /// scale is not positive.
  Loss loss(const Block& block) const;
  void set_loss(const Block& block, const Loss& loss);
  /// Replaces the residual of a soft or hard block, for example by a new measurement. Keeps an NlpEvaluator valid.
  /// Throws BadInputError if the block has another residual type.
  template <Residual R>
  void set_residual(const Block& block, const R& residual) {
    set_residual(block, detail::kResidualFunctions<R>, &residual);
  }
  /// Replaces the bounds of a hard block. An NlpEvaluator reads them at its next reset(). Throws BadInputError for a
  /// soft block, a wrong number of rows, or bounds that subject_to() rejects.
  template <int N>
  void set_bounds(const Block& block, const Bounds<N>& bounds) {
    set_bounds(block, N, bounds.lower.data(), bounds.upper.data());
  }
  void set_bounds(const Block& block, const UniformBounds& bounds);
  /// Returns the bounds of a hard block. Throws BadInputError for a soft block.
  Bounds<Eigen::Dynamic> bounds(const Block& block) const;
  /// Return and set the Lagrange multipliers of a hard block, one per row. A multiplier is the decrease of the minimal
  /// cost per unit by which the active bound is raised. It is positive at an upper bound, negative at a lower bound,
  /// and 0 if no bound is active or before the first solve.
  /// The solvers augmented-lagrangian and ipopt store multipliers when they converge. They start from them if their
  /// option `from_multipliers` is set. Both functions throw BadInputError for a soft block; set_multipliers() also if
  /// the size is wrong or a value is not finite.
  Eigen::VectorXd multipliers(const Block& block) const;
  void set_multipliers(const Block& block, const Eigen::VectorXd& multipliers);
  /// Residual and Jacobian of a block at the current values, in the residual's units, without noise and loss.
  struct Linearization {
    Eigen::VectorXd residual;
    Eigen::MatrixXd jacobian;             ///< with respect to right perturbations of all variables, side by side
    std::vector<int> variable_ids, dofs;  ///< see variable_ids(); tangent dimension of each variable
  };
  /// Returns the linearization of a soft or hard block. Throws UndefinedResidualError if the residual is undefined.
  Linearization linearization(const Block& block) const;
  /// Returns the linearization of a residual that is not part of the problem and reads the variables with these IDs.
  Linearization linearization(const detail::ResidualFunctions& functions, const void* residual,
                              std::span<const int> variable_ids) const;
  std::vector<int> variable_ids(const Block& block) const;  ///< variables that a block reads, fixed ones included
  /// Return the soft or hard blocks that read at least one of these variables, except marginal priors and constraints.
  std::vector<Block> soft_blocks_reading(std::span<const int> variable_ids) const;
  std::vector<Block> hard_blocks_reading(std::span<const int> variable_ids) const;
  /// Multiplies the scale of every robust loss, of existing and future blocks, by `factor`. The factor replaces the
  /// previous one; 1 restores the given scales. Graduated non-convexity starts with a large factor. Throws
  /// BadInputError if the factor is not positive and finite.
  void scale_losses(double factor);
  double loss_scale() const { return loss_scale_; }
  /// Returns the smallest factor for scale_losses() with which every block is in the convex region of its robust loss
  /// (Loss::convexity_limit) at the current values, whatever loss_scale() is. Empty if no block has a robust loss.
  std::optional<double> convex_loss_scale() const;

  /// Returns the handles of all variables of group G in the order in which they were added.
  template <LieGroup G>
  std::vector<Variable<G>> variables() const {
    std::vector<Variable<G>> result;
    const auto it = stores_.find(typeid(G));
    if (it == stores_.end()) return result;
    for (const int id : ids_by_creation(*it->second)) result.emplace_back(handle(id));
    return result;
  }
  /// Returns the handles of all blocks, including the marginal prior, in the order of evaluation: grouped by residual
  /// type and role.
  std::vector<Block> blocks() const;
  /// Returns a description for messages, for example "prior of x0": the residual and the variables it reads.
  std::string describe(const Block& block) const;
  int num_variables() const { return ids_.size(); }
  /// Returns a number above all variable IDs, for arrays indexed by ID. IDs below it may be unused; their name is then
  /// empty. The functions with an ID throw StaleHandleError if it is not in [0, id_bound()).
  int id_bound() const { return static_cast<int>(variables_.size()); }
  const std::string& name(int variable_id) const { return info(variable_id).name(); }
  /// Returns how many variables had been added before this one, −1 for an unused ID. Unlike IDs, these numbers are
  /// never reused.
  long long sequence_number(int variable_id) const { return info(variable_id).sequence; }
  bool is_fixed(int variable_id) const { return info(variable_id).fixed; }
  /// Returns a handle of the variable with this ID. For an unused ID, the handle is invalid as if never set.
  VariableHandle handle(int variable_id) const;
  /// Returns the ID of a variable, in [0, id_bound()). IDs of removed variables are reused.
  int id(const VariableHandle& x) const {
    if (!has(x)) throw_invalid(x);
    return x.slot;
  }
  int num_soft_blocks() const;
  int num_hard_blocks() const;
  /// Size of the program: `unknowns` is the sum of the tangent dimensions of the free variables; the others count hard
  /// rows with equal and with different bounds, except those that read only fixed variables.
  struct Size {
    int unknowns, equalities, inequalities;
  };
  Size size() const;

 private:
  friend class NlpEvaluator;
  friend class Subproblem;
  friend class detail::ProblemData;
  template <Residual R>
  static constexpr int arity = std::tuple_size_v<typename R::States>;

  struct VariableInfo {
    detail::StateStoreBase* store = nullptr;  // null if the ID is unused
    int slot = -1, dof = 0;
    int readers = 0;  // number of times that blocks read the variable
    bool fixed = false;
    long long sequence = -1;  // order of creation, in which solvers keep the variables; IDs are reused

    bool is_free() const { return store && !fixed; }
    const std::string& name() const;  // empty if the ID is unused
  };
  struct Pool {
    std::unique_ptr<detail::SoftPoolBase> soft;  // exactly one of soft and hard is set
    std::unique_ptr<detail::HardPoolBase> hard;
    detail::Slots ids;  // a block keeps its ID when other blocks are removed
    std::vector<int> index_of_id, id_of_index;
    std::vector<std::uint64_t> problem_of_id;    // serial number of the problem to which the block was added
    const detail::ResidualType* type = nullptr;  // null for the marginal prior and constraint

    detail::PoolBase& base() const { return soft ? static_cast<detail::PoolBase&>(*soft) : *hard; }
  };
  template <LieGroup G>
  [[gnu::noinline]] detail::StateStore<G>& store() {
    static_cast<void>(&group_type<G>);  // instantiates and thereby registers the group
    auto& s = stores_[typeid(G)];
    if (!s) s = std::make_unique<detail::StateStore<G>>();
    return static_cast<detail::StateStore<G>&>(*s);
  }
  template <LieGroup G>
  static detail::StateStoreBase* store_of(Problem& p) {
    return &p.store<G>();
  }
  template <LieGroup G>
  inline static const detail::GroupType group_type{typeid(G), &store_of<G>};
  template <Residual R>
  static void stores_of(const detail::ResidualType&, Problem& p, detail::StateStoreBase** stores) {
    [&]<class... Xs>(std::tuple<Xs...>*) {
      ((*stores++ = &p.store<Xs>()), ...);
    }(static_cast<typename R::States*>(nullptr));
  }
  template <Residual R>
  std::array<int, std::size_t(arity<R>)> slots(const VariablesOf<R>& x) {
    return std::apply(
        [&](const auto&... v) {
          return std::array<int, std::size_t(arity<R>)>{variables_[std::size_t(id(v))].slot...};
        },
        x);
  }
  [[noreturn]] void throw_invalid(const VariableHandle& x) const;
  void check_counterpart(const VariableHandle& x) const;
  const VariableInfo& info(int variable_id) const {
    if (std::size_t(variable_id) >= variables_.size()) throw_no_variable(variable_id);
    return variables_[std::size_t(variable_id)];
  }
  [[noreturn]] void throw_no_variable(int variable_id) const;
  Block handle(int pool, int id) const;
  std::vector<int> ids_by_creation(const detail::StateStoreBase& store) const;

  template <Residual R, bool hard>
  static constexpr detail::ResidualType residual_type{detail::kResidualFunctions<R>, hard, &detail::pass_residual<R>,
                                                      &stores_of<R>};
  template <Residual R, bool hard>
  inline static const detail::RegisteredResidual registered{residual_type<R, hard>};
  template <Residual R, bool hard>
  static const detail::ResidualType& type_of() {
    static_cast<void>(&registered<R, hard>);  // instantiates and thereby registers the type
    return residual_type<R, hard>;
  }
  Block add_soft(const detail::ResidualType& type, const void* residual, const int* slots, const Gaussian& noise,
                 const Loss& loss);
  Block add_hard(const detail::ResidualType& type, const void* residual, const int* slots, const double* lower,
                 const double* upper);
  void set_residual(const Block& block, const detail::ResidualFunctions& functions, const void* residual);
  int pool_of(const detail::ResidualType& type);  // adds the pool if there is none yet
  std::vector<int> slots_of(const detail::ResidualType& type, std::span<const VariableHandle> x);
  int new_variable_id();
  detail::VariableName variable_name(std::string name) const;  // "variable N" if empty
  VariableHandle new_variable(int id, detail::StateStoreBase& store, int slot);
  void remove_variable(int id);
  Block new_block(int pool);
  void remove_block_at(int pool, int index);
  std::string describe(const detail::PoolBase& pool, int block) const;
  std::vector<std::vector<int>> blocks_to_marginalize(const std::vector<char>& marked) const;
  detail::LinearRows active_rows(const std::vector<std::vector<int>>& affected, const std::vector<int>& offset,
                                 int unknowns) const;
  void add_marginal_constraint(const std::vector<detail::AnchoredState>& states, const detail::LinearRows& equations);
  std::optional<Block> only_block(int pool) const;
  std::vector<Block> blocks_reading(std::span<const int> variable_ids, bool hard) const;
  int index_of(const Block& block, const char* caller) const;
  detail::SoftPoolBase& soft_pool_of(const Block& block, const char* caller) const;
  detail::HardPoolBase& hard_pool_of(const Block& block, const char* caller) const;
  void set_bounds(const Block& block, int rows, const double* lower, const double* upper);
  static void check_bounds(std::string_view name, int rows, const double* lower, const double* upper);

  /// All members that swap() exchanges.
  auto contents() {
    return std::tie(variables_, ids_, next_sequence_, stores_, pools_, pool_of_type_, prior_pool_, constraint_pool_,
                    loss_scale_, serial_, revision_, value_revision_, bounds_revision_);
  }

  std::vector<VariableInfo> variables_;  // indexed by ID
  detail::Slots ids_;
  long long next_sequence_ = 0;
  std::map<std::type_index, std::unique_ptr<detail::StateStoreBase>> stores_;
  std::vector<Pool> pools_;
  // Key: C++ type of the residual, hard, and the type itself if it was made at run time.
  std::map<std::tuple<std::type_index, bool, const detail::ResidualType*>, int> pool_of_type_;
  int prior_pool_ = -1;       // pool of the marginal prior, −1 before the first marginalize()
  int constraint_pool_ = -1;  // pool of the marginal constraint, −1 before it exists
  double loss_scale_ = 1.0;   // copied to every soft pool
  std::uint64_t serial_ = detail::new_problem_serial();
  // Revision counters. Each NlpEvaluator compares them to detect changes of the structure (variables and blocks), of
  // values, and of bounds, noises, losses and residuals. point_owner_: evaluator whose point the state stores hold.
  long long revision_ = 0, value_revision_ = 0, bounds_revision_ = 0;
  const NlpEvaluator* point_owner_ = nullptr;
};

}  // namespace tandem
