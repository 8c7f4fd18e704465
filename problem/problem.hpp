#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <typeindex>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/problem/handles.hpp>
#include <tandem/problem/hard_pool.hpp>
#include <tandem/problem/residual_type.hpp>
#include <tandem/problem/soft_pool.hpp>

namespace tandem {

class Program;
class ProblemPart;

namespace detail {
class ProblemData;
}

/// A nonlinear program over Lie groups:
///
///   minimize ½ Σ ρ(rᵀ Σ⁻¹ r)   subject to   lower ≤ r ≤ upper
///
/// with one residual object for both roles. Solve it with solve(problem, options) of a solver; the variables then hold
/// the solution. Not thread-safe; moving keeps handles valid. What is removed leaves its place to what comes: however
/// long a problem gains and loses variables and blocks, it takes the memory of the most that it had at once.
class Problem {
 public:
  Problem() = default;
  Problem(Problem&&) = default;
  Problem& operator=(Problem&&) = default;
  /// Another problem of the same variables and blocks, to be solved from another start, for example: solves of both are the
  /// same to the last bit, and what is done to one leaves the other as it is. Blocks' handles and variables' ids hold in
  /// both; a variable's handle is of one problem, see counterpart().
  Problem copy() const;
  /// The variable where `x` is in the problem that this is a copy of, or a copy of this. Throws Error when there is none.
  template <LieGroup G>
  Variable<G> counterpart(const Variable<G>& x) const {
    const auto it = stores_.find(typeid(G));
    const Variable<G> own{it == stores_.end() ? nullptr : static_cast<detail::StateStore<G>*>(it->second.get()), x.slot,
                          x.generation};
    if (!is_current(own)) throw_no_counterpart();
    return own;
  }

  /// A new variable at `initial`. `name` is what messages call it.
  template <LieGroup G>
  Variable<G> add(const G& initial, std::string name = {}) {
    auto& states = store<G>();
    const int id = new_variable_id();
    const int slot = states.add(initial, id);
    variables_[std::size_t(id)] = {&states,
                                   slot,
                                   G::dof,
                                   0,
                                   false,
                                   next_sequence_,
                                   name.empty() ? "variable " + std::to_string(next_sequence_) : std::move(name)};
    ++next_sequence_;
    ++revision_;
    return {&states, slot, states.slots.generation(slot)};
  }
  /// Takes a variable out; its handles are no longer valid, and its id may be given to the next one. Throws Error,
  /// naming the variable, when a block still reads it.
  template <LieGroup G>
  void remove(const Variable<G>& x) {
    check_owned(x);
    remove_variable(id(x));
  }
  /// Whether the handle is of a variable of this problem that has not been removed.
  template <LieGroup G>
  bool has(const Variable<G>& x) const {
    const auto it = stores_.find(typeid(G));
    return it != stores_.end() && it->second.get() == x.store && is_current(x);
  }
  /// Throws Error when the variable has been removed, or never was.
  template <LieGroup G>
  const G& value(const Variable<G>& x) const {
    check_current(x);
    return x.store->value[std::size_t(x.slot)];
  }
  template <LieGroup G>
  void set_value(const Variable<G>& x, const G& value) {
    check_owned(x);
    ++value_revision_;
    x.store->value[std::size_t(x.slot)] = x.store->point[std::size_t(x.slot)] = value;
  }
  /// A fixed variable keeps its value: solvers do not see it.
  template <LieGroup G>
  void fix(const Variable<G>& x, bool fixed = true) {
    check_owned(x);
    ++revision_;
    variables_[std::size_t(id(x))].fixed = fixed;
  }

  template <LieGroup G>
  bool is_fixed(const Variable<G>& x) const {
    return variables_[std::size_t(id(x))].fixed;
  }

  /// A cost. Throws Error when the noise has not R::dim rows.
  template <Residual R>
  Block minimize(const R& residual, const Gaussian& noise, const VariablesOf<R>& x, const Loss& loss = {}) {
    check_noise(R::name, R::dim, noise, loss);
    auto [index, pool] = soft_pool<R>();
    pool.add(residual, slots<R>(x), noise, loss);
    return new_block(index);
  }

  /// A constraint, in the residual's own units. Throws Error when a lower bound is above its upper bound, or no number
  /// is between them.
  template <Residual R>
  Block subject_to(const R& residual, const Bounds<R::dim>& bounds, const VariablesOf<R>& x) {
    check_bounds(R::name, R::dim, bounds.lower.data(), bounds.upper.data());
    auto [index, pool] = hard_pool<R>();
    pool.add(residual, slots<R>(x), bounds);
    return new_block(index);
  }

  /// Takes a block out. Throws Error when it is not there (any more).
  void remove(const Block& block);
  /// Whether it is there.
  bool has(const Block& block) const;

  /// Replaces all soft blocks that read any of these variables, and with them the problem's marginal prior if there is
  /// one, by one new marginal prior on the other free variables that they read, and removes these variables.
  ///
  /// The prior is what is left of the blocks' Gauss-Newton model at the variables' values when it is minimised over
  /// these variables (their Schur complement in the tangent space of right perturbations; robust losses by their weight
  /// ρ' there):  ½‖A (X ⊖ X̄) + b‖² + c, X̄ the values now, for as long as this prior lasts. c makes its cost here that of
  /// the minimised model, so that costs before and after compare. Exact where the residuals are linear. See
  /// detail::MarginalPrior. Its weak point is any linearisation's: fixed X̄ while the estimate moves on.
  ///
  /// A direction of these variables that no block observes leaves nothing; neither does one of the others on which only
  /// rounding is left of the information, at some 1e-13 of what the blocks have. What fixed variables have to do with
  /// the rest is lost: free them before, not after.
  ///
  /// Throws Error, and changes nothing, when a hard block reads one of them, when a residual is undefined or not finite
  /// at the values, or when one is not there (any more). Do not call it while a Program of this problem lives.
  void marginalize(std::span<const int> variable_ids);
  template <LieGroup... Gs>
  void marginalize(const Variable<Gs>&... x) {
    (check_owned(x), ...);
    marginalize(std::array<int, sizeof...(Gs)>{id(x)...});
  }
  /// The prior that marginalize() has left; empty when there is none.
  std::optional<Block> marginal_prior() const;

  /// ρ'(s) of a soft block at the variables' values: what its robust loss leaves of its influence, 1 without a loss.
  /// Throws Error for a hard block and for one that is not there (any more).
  double weight(const Block& block) const;
  /// The noise of a soft block, and another in its place, for which no Program needs to be compiled anew. Throw Error for
  /// a hard block and one that is not there (any more); set_noise, too, when the noise has not as many rows.
  Gaussian noise(const Block& block) const;
  void set_noise(const Block& block, const Gaussian& noise);
  /// The robust loss of a soft block, and another in its place. Throw Error as these do.
  Loss loss(const Block& block) const;
  void set_loss(const Block& block, const Loss& loss);
  /// Another residual of the same type in a block's place, soft or hard: another measurement, for which no Program needs to
  /// be compiled anew. Throws Error for a block of another type and one that is not there (any more).
  template <Residual R>
  void set_residual(const Block& block, const R& residual) {
    const int index = index_of(block, "set_residual");
    if (block.pool == pool_of(typeid(detail::SoftPool<R>)))
      soft_pool<R>().pool.set_residual(index, residual);
    else if (block.pool == pool_of(typeid(detail::HardPool<R>)))
      hard_pool<R>().pool.set_residual(index, residual);
    else
      throw Error("set_residual: the block is no " + std::string(R::name));
    ++bounds_revision_;
  }
  /// Other bounds of a hard block; a Program goes by them from its next reset() on. Throws Error for a soft block, one that is
  /// not there (any more), and bounds that subject_to() or the block's rows do not allow.
  template <int N>
  void set_bounds(const Block& block, const Bounds<N>& bounds) {
    set_bounds(block, N, bounds.lower.data(), bounds.upper.data());
  }
  void set_bounds(const Block& block, const UniformBounds& bounds);
  /// Lagrange's multipliers of a hard block, one a row: by how much the least cost falls when the bound that the row is at
  /// moves up by a unit. Above zero at an upper bound, below zero at a lower one, 0 where the row is at none. The
  /// solvers that have them (augmented-lagrangian, ipopt) leave them here once they have converged, and
  /// start from them when their options say so (`from_multipliers`); 0 of blocks that no solve has seen. Throw Error for a
  /// soft block and one that is not there (any more); set_multipliers, too, when they are not as many as rows, or not finite.
  Eigen::VectorXd multipliers(const Block& block) const;
  void set_multipliers(const Block& block, const Eigen::VectorXd& multipliers);
  /// A block at the variables' values, in its residual's own units: its rows, and by right perturbations of the variables
  /// that it reads, fixed ones too, its Jacobian, whose columns are theirs one after the other. Throws Error when it is not
  /// there (any more).
  struct Linearization {
    Eigen::VectorXd residual;
    Eigen::MatrixXd jacobian;
    std::vector<int> variable_ids;
    std::vector<int> dofs;
  };
  Linearization linearization(const Block& block) const;
  /// The soft blocks that read one of these variables, ids below id_bound(), but for the marginal prior.
  std::vector<Block> soft_blocks_reading(std::span<const int> variable_ids) const;
  /// From now on every robust loss, also of blocks to come, has `factor` times its own scale; 1 is as it was given.
  /// Throws Error when the factor is not positive and finite.
  void widen_losses(double factor);
  double widening() const { return widening_; }
  /// The least factor with which every robust block is in its loss's convex region (Loss::convex_until) at the
  /// variables' values, whatever the widening now. Empty when no loss is robust.
  std::optional<double> convex_widening() const;

  /// Handles of all variables of a group, in order of creation.
  template <LieGroup G>
  std::vector<Variable<G>> variables() const {
    std::vector<Variable<G>> result;
    const auto it = stores_.find(typeid(G));
    if (it == stores_.end()) return result;
    auto* store = static_cast<detail::StateStore<G>*>(it->second.get());
    for (const int slot : slots_by_creation(*store)) result.push_back({store, slot, store->slots.generation(slot)});
    return result;
  }
  /// Handles of all blocks, the marginal prior too, in the order of evaluation: pool by pool.
  std::vector<Block> blocks() const;
  /// "prior of x0": the residual's name and what it reads. Throws Error when the block is not there (any more).
  std::string describe(const Block& block) const;
  int num_variables() const { return ids_.size(); }
  /// Ids are below this. Some may be of no variable now: their names are empty.
  int id_bound() const { return static_cast<int>(variables_.size()); }
  const std::string& name(int variable_id) const { return variables_[std::size_t(variable_id)].name; }
  /// How many variables had been made before it: ids are given again, these numbers never. −1 where the id is of none.
  long long creation(int variable_id) const { return variables_[std::size_t(variable_id)].sequence; }
  bool is_fixed(int variable_id) const { return variables_[std::size_t(variable_id)].fixed; }
  /// Below id_bound(). Throws Error when the variable has been removed, or never was.
  template <LieGroup G>
  int id(const Variable<G>& x) const {
    check_current(x);
    return x.store->id[std::size_t(x.slot)];
  }
  int num_soft_blocks() const;
  int num_hard_blocks() const;
  /// Tangent dimensions of the free variables; hard rows with equal bounds, and all others, of blocks that read one.
  struct Size {
    int unknowns, equalities, inequalities;
  };
  Size size() const;

 private:
  friend class Program;
  friend class ProblemPart;
  friend class detail::ProblemData;
  template <Residual R>
  static constexpr int arity = std::tuple_size_v<typename R::States>;

  struct VariableInfo {
    detail::StateStoreBase* store = nullptr;  // null where the id is free
    int slot = -1, dof = 0;
    int readers = 0;  // how often blocks read it
    bool fixed = false;
    long long sequence = -1;  // solvers keep the variables in order of creation, which ids are not
    std::string name;

    bool is_free() const { return store && !fixed; }
  };
  struct Pool {
    std::unique_ptr<detail::SoftPoolBase> soft;  // one of the two
    std::unique_ptr<detail::HardPoolBase> hard;
    detail::Slots ids;  // blocks keep their id when others are removed
    std::vector<int> index_of_id, id_of_index;
    const detail::ResidualType* type = nullptr;  // null of the marginal prior

    detail::PoolBase& base() const { return soft ? static_cast<detail::PoolBase&>(*soft) : *hard; }
  };
  template <class P>
  struct Found {
    int index;
    P& pool;
  };

  template <LieGroup G>
  [[gnu::noinline]] detail::StateStore<G>& store() {
    static_cast<void>(&group_type<G>);  // is made, and registers, with what uses it
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
  auto stores() {
    return []<class... Xs>(Problem& p, std::tuple<Xs...>*) {
      return std::tuple<detail::StateStore<Xs>*...>(&p.store<Xs>()...);
    }(*this, static_cast<typename R::States*>(nullptr));
  }
  template <Residual R>
  std::array<int, std::size_t(arity<R>)> slots(const VariablesOf<R>& x) {
    return std::apply(
        [&](const auto&... v) {
          (check_owned(v), ...);
          return std::array<int, std::size_t(arity<R>)>{v.slot...};
        },
        x);
  }
  template <LieGroup G>
  void check_owned(const Variable<G>& x) {
    if (x.store != &store<G>()) throw Error("the problem was given a variable that is not its own");
    check_current(x);
  }
  template <LieGroup G>
  static bool is_current(const Variable<G>& x) {
    return x.store && x.store->slots.is_current(x.slot, x.generation);
  }
  template <LieGroup G>
  static void check_current(const Variable<G>& x) {
    if (!is_current(x)) throw_stale(x.store != nullptr);
  }
  [[noreturn]] static void throw_stale(bool removed);
  [[noreturn]] static void throw_no_counterpart();
  std::vector<int> slots_by_creation(const detail::StateStoreBase& store) const;

  template <Residual R>
  Found<detail::SoftPool<R>> soft_pool() {
    int index = pool_of(typeid(detail::SoftPool<R>));
    if (index < 0)
      index = add_pool(typeid(detail::SoftPool<R>), soft_type<R>, std::make_unique<detail::SoftPool<R>>(stores<R>()),
                       nullptr);
    return {index, static_cast<detail::SoftPool<R>&>(*pools_[std::size_t(index)].soft)};
  }
  template <Residual R>
  Found<detail::HardPool<R>> hard_pool() {
    int index = pool_of(typeid(detail::HardPool<R>));
    if (index < 0)
      index = add_pool(typeid(detail::HardPool<R>), hard_type<R>, nullptr,
                       std::make_unique<detail::HardPool<R>>(stores<R>()));
    return {index, static_cast<detail::HardPool<R>&>(*pools_[std::size_t(index)].hard)};
  }
  template <Residual R>
  static int index_of_soft(Problem& p) {
    return p.soft_pool<R>().index;
  }
  template <Residual R>
  static int index_of_hard(Problem& p) {
    return p.hard_pool<R>().index;
  }
  template <Residual R>
  inline static const detail::ResidualType soft_type{typeid(R), false, &detail::pass_residual<R>, &index_of_soft<R>};
  template <Residual R>
  inline static const detail::ResidualType hard_type{typeid(R), true, &detail::pass_residual<R>, &index_of_hard<R>};
  int pool_of(std::type_index type) const;  // −1: none yet
  int add_pool(std::type_index type, const detail::ResidualType& residual, std::unique_ptr<detail::SoftPoolBase> soft,
               std::unique_ptr<detail::HardPoolBase> hard);  // one of the two
  int new_variable_id();
  void remove_variable(int id);
  Block new_block(int pool);
  void remove_block_at(int pool, int index);
  std::string describe(const detail::PoolBase& pool, int block) const;
  std::vector<std::vector<int>> blocks_to_marginalize(const std::vector<char>& marked) const;
  int index_of(const Block& block, const char* asked) const;
  detail::SoftPoolBase& soft_pool_of(const Block& block, const char* asked) const;
  detail::HardPoolBase& hard_pool_of(const Block& block, const char* asked) const;
  void set_bounds(const Block& block, int rows, const double* lower, const double* upper);
  static void check_noise(std::string_view name, int rows, const Gaussian& noise, const Loss& loss);
  static void check_bounds(std::string_view name, int rows, const double* lower, const double* upper);

  std::vector<VariableInfo> variables_;  // by id
  detail::Slots ids_;
  long long next_sequence_ = 0;
  std::map<std::type_index, std::unique_ptr<detail::StateStoreBase>> stores_;
  std::vector<Pool> pools_;
  std::map<std::type_index, int> pool_of_type_;
  int prior_pool_ = -1;    // of the marginal prior, once there has been one
  double widening_ = 1.0;  // also in every soft pool
  // Programs notice by these that variables or blocks, values, or bounds (with noises, losses and residuals, of which soft
  // bounds are made) are no longer what they were compiled for, and that another Program has moved the point.
  long long revision_ = 0, value_revision_ = 0, bounds_revision_ = 0;
  const Program* point_of_ = nullptr;
};

}  // namespace tandem
