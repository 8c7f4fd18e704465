#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <string_view>
#include <tuple>
#include <vector>

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/static_for.hpp>
#include <tandem/problem/block.hpp>
#include <tandem/problem/state_store.hpp>
#include <tandem/residuals/batched.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem::detail {

/// Maps a state store to the store of the same group in another problem. A pool calls it for each state in order.
using StoreMapping = std::function<StateStoreBase*(const StateStoreBase*)>;

/// Locations of the blocks of a pool in the arrays of a solver; computed once by NlpEvaluator.
struct PoolPlacement {
  std::vector<int> offset;            ///< blocks × arity: first unknown of the state, −1 if fixed
  std::vector<HessianPlace> hessian;  ///< blocks × arity (arity + 1) / 2: pair (a, b ≤ a) at a (a + 1) / 2 + b
  std::vector<int> jacobian;          ///< blocks: first value in the constraint Jacobian (hard pools only)
  std::vector<int> order;             ///< blocks in the order of evaluation; empty if that is their own order

  /// Returns the block at position k in the order of evaluation.
  int at(int k) const { return order.empty() ? k : order[static_cast<std::size_t>(k)]; }
};

/// Selects the exact Hessian, or the exact minus the Gauss-Newton Hessian.
enum class Curvature { all, beyond_gauss_newton };

/// All blocks of one residual type and role. They are stored contiguously and evaluated in one loop, with one virtual
/// call per pool.
class PoolBase {
 public:
  virtual ~PoolBase() = default;
  virtual std::string_view name() const = 0;
  virtual int dim() const = 0;
  virtual int arity() const = 0;
  virtual int size() const = 0;
  /// Returns the arity() IDs of the variables that block i reads.
  virtual const int* variables(int i) const = 0;
  /// Returns whether block i reads a marked variable; `marked` is indexed by ID.
  bool reads(int i, const std::vector<char>& marked) const {
    const int* ids = variables(i);
    return std::any_of(ids, ids + arity(), [&](int id) { return marked[static_cast<std::size_t>(id)] != 0; });
  }
  /// Removes block i. The last block takes its index.
  virtual void remove(int i) = 0;
  /// Adds a copy of block i of `from`, a pool of the same residual type and role, that reads the states at `slots`.
  virtual void add_copy(const PoolBase& from, int i, const int* slots) = 0;
  /// Returns the residual object of block i.
  virtual const void* residual(int i) const = 0;
  /// Appends a residual without noise, loss or bounds; the caller must add those.
  virtual void add_residual(const void* residual, const int* slots) = 0;
  /// Computes the rows of block i at the point, in the units of the residual.
  virtual void evaluate_block(int i, double* r) const = 0;
  /// Also computes the Jacobians of all states, one after the other. Jacobians of states with a negative offset are 0.
  /// If `offset` is null, all states count as free.
  virtual void linearize_block(int i, const int* offset, double* r, double* J) const = 0;
  /// Returns the tangent dimension of each state.
  virtual const int* dofs() const = 0;
  /// Adds ‖W J v‖² to `along` and ‖W J diag(v)‖² to `scale` over all blocks. Hard pools use `row_weights` as the
  /// squares of the diagonal of W; soft pools use their noise and loss.
  virtual void add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                             double& scale) const = 0;
  /// Adds the exact Hessian of factor · cost (soft pools) or multipliersᵀ c (hard pools) of the blocks begin … end − 1
  /// in the order of evaluation.
  ///
  /// If the residual implements second derivatives, those of the charts are not included.
  /// StateStoreBase::add_chart_curvature() computes them from `gradient`, to which this function adds the gradient with
  /// respect to perturbations of the point. Otherwise the Hessian is a central difference of the closed-form gradient
  /// and includes the charts.
  virtual void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                                 const double* multipliers, double* gradient, double* H) const = 0;

 protected:
  /// Removes entry i. The last entry takes its index.
  template <class T>
  static void remove_from(std::vector<T>& v, int i) {
    v[static_cast<std::size_t>(i)] = v.back();
    v.pop_back();
  }
};

/// Common part of the soft and hard pools of residual R: residuals, states and their evaluation at the point.
template <Residual R, class Base>
class BlockPool : public Base {
 public:
  using States = typename R::States;
  static constexpr int kDim = R::dim, kArity = std::tuple_size_v<States>, kPairs = kArity * (kArity + 1) / 2;
  template <int S>
  using State = std::tuple_element_t<S, States>;

  std::string_view name() const override { return R::name; }
  int dim() const override { return kDim; }
  int arity() const override { return kArity; }
  int size() const override { return static_cast<int>(blocks_.size()); }
  const int* variables(int i) const override { return blocks_[static_cast<std::size_t>(i)].ids.data(); }
  const int* dofs() const override { return kDofs.data(); }
  void evaluate_block(int i, double* r) const override {
    Row row;
    value(std::size_t(i), row);
    std::copy_n(row.data(), kDim, r);
  }
  const void* residual(int i) const override { return &blocks_[std::size_t(i)].residual; }
  void add_residual(const void* residual, const int* slots) override {
    std::array<int, kArity> own;
    std::copy_n(slots, kArity, own.begin());
    add_block(*static_cast<const R*>(residual), own);
  }
  void set_residual(int i, const R& residual) { blocks_[std::size_t(i)].residual = residual; }
  void linearize_block(int i, const int* offset, double* r, double* J) const override {
    constexpr std::array<int, std::size_t(kArity)> wanted{};
    Row row;
    Jacobians jacobians;
    set_zero(jacobians);
    linearize(std::size_t(i), offset ? offset : wanted.data(), row, jacobians);
    std::copy_n(row.data(), kDim, r);
    for (int s = 0; s < kArity; ++s) J = std::copy_n(data(jacobians)[std::size_t(s)], kDim * kDofs[std::size_t(s)], J);
  }

 protected:
  template <class Sequence>
  struct Tuples;
  template <int... S>
  struct Tuples<std::integer_sequence<int, S...>> {
    using Stores = std::tuple<StateStore<State<S>>*...>;
    using Points = std::tuple<const State<S>*...>;
    using Jacobians = std::tuple<Matrix<kDim, State<S>::dof>...>;
    static constexpr std::array<int, std::size_t(kArity)> dofs{State<S>::dof...};
    static constexpr int sum_of_dofs = (State<S>::dof + ...);
    static constexpr bool curved = (HasExpCurvature<State<S>> && ...);
  };
  using Types = Tuples<std::make_integer_sequence<int, kArity>>;
  using Stores = typename Types::Stores;
  using Jacobians = typename Types::Jacobians;
  /// Array for the Jacobians of all states.
  using Transposed = std::array<double, std::size_t(kDim* Types::sum_of_dofs)>;
  static constexpr auto kDofs = Types::dofs;
  static constexpr int kSumOfDofs = Types::sum_of_dofs;
  /// Whether the residual implements second derivatives and all groups support them.
  static constexpr bool kCurvature = HasCurvature<R> && Types::curved;
  static_assert(*std::max_element(kDofs.begin(), kDofs.end()) <= kMaxDofs && kDim <= kMaxRows && kArity <= kMaxStates);
  using Row = Vector<kDim>;

  explicit BlockPool(const Stores& stores) : stores_(stores) {}

  void add_block(const R& residual, const std::array<int, kArity>& slots) {
    std::array<int, kArity> ids;
    static_for<kArity>([&]<int S>() { ids[S] = std::get<S>(stores_)->id[std::size_t(slots[S])]; });
    blocks_.push_back({residual, slots, ids});
  }
  void remove_residual(int i) override { this->remove_from(blocks_, i); }
  Stores stores_of(const StoreMapping& mapping) const {
    return std::apply(
        [&]<class... Xs>(StateStore<Xs>*... store) { return Stores{static_cast<StateStore<Xs>*>(mapping(store))...}; },
        stores_);
  }

  typename Types::Points points(std::size_t i) const {
    typename Types::Points p;
    static_for<kArity>(
        [&]<int S>() { std::get<S>(p) = &std::get<S>(stores_)->point[std::size_t(blocks_[i].slots[S])]; });
    return p;
  }

  [[gnu::noinline]] void value(std::size_t i, Row& r) const {
    std::apply([&](const auto*... x) { blocks_[i].residual(*x..., r); }, points(i));
  }

  /// Computes r, and the Jacobians J with respect to δ of the states whose offset is not negative.
  void linearize(std::size_t i, const int* offset, Row& r, Jacobians& J) const {
    linearize_at(i, points(i), offset, r, J);
    apply_charts(i, offset, J);
  }
  /// Returns whether blocks are evaluated in batches, several per vector register.
  static bool batches() { return instruction_set() != InstructionSet::baseline; }
  using Blocks = std::array<std::size_t, kBatch>;
  /// Returns the blocks at positions k, k + 1, … in the order of evaluation. Positions from `end` on repeat the last
  /// block.
  static Blocks batch(const PoolPlacement& place, int k, int end) {
    Blocks blocks;
    for (int b = 0; b < kBatch; ++b) blocks[std::size_t(b)] = std::size_t(place.at(std::min(k + b, end - 1)));
    return blocks;
  }
  /// Computes r, and J with respect to perturbations of the point, for a batch; see Batched.
  void linearize_batch(const Blocks& blocks, double* r, double* J) const {
    std::array<double*, std::size_t(kArity)> jacobians;
    static_for<kArity>([&]<int S>() {
      jacobians[S] = J;
      J += kBatch * kDim * kDofs[S];
    });
    Batched<R>::linearize(residuals(blocks), states(blocks), r, jacobians);
  }
  void evaluate_batch(const Blocks& blocks, double* r) const {
    Batched<R>::evaluate(residuals(blocks), states(blocks), r);
  }
  void curvature_batch(const Blocks& blocks, const double* w, double* C) const {
    Batched<R>::curvature(residuals(blocks), states(blocks), w, C);
  }
  /// Returns the Jacobian of each state of block b in a batch, within J as computed by linearize_batch().
  static std::array<double*, std::size_t(kArity)> of_batch(double* J, int b) {
    std::array<double*, std::size_t(kArity)> columns;
    for (int s = 0, first = 0; s < kArity; first += kBatch * kDim * kDofs[std::size_t(s)], ++s)
      columns[std::size_t(s)] = J + first + b * kDim * kDofs[std::size_t(s)];
    return columns;
  }
  void apply_charts(std::size_t i, const int* offset, Jacobians& J) const {
    detail::apply_charts<kDim>(shape(offset), charts(i).data(), data(J).data());
  }
  static void set_zero(Jacobians& J) {
    static_for<kArity>([&]<int A>() { std::fill_n(std::get<A>(J).data(), kDim * kDofs[A], 0.0); });
  }

  static BlockShape shape(const int* offset) { return {kDim, kArity, kDofs.data(), offset}; }
  /// Returns the chart of each state, null if it is the identity.
  std::array<const double*, std::size_t(kArity)> charts(std::size_t i) const {
    std::array<const double*, std::size_t(kArity)> result{};
    static_for<kArity>([&]<int S>() {
      const auto& store = *std::get<S>(stores_);
      if (store.charted) result[S] = store.chart[std::size_t(blocks_[i].slots[S])].data();
    });
    return result;
  }
  /// Returns pointers to the Jacobians of the states.
  static std::array<double*, std::size_t(kArity)> data(Jacobians& J) {
    std::array<double*, std::size_t(kArity)> result;
    static_for<kArity>([&]<int S>() { result[S] = std::get<S>(J).data(); });
    return result;
  }

  /// Adds Σ w_k ∂²r_k to the Hessian, through the charts to first order, and Jᵀ w to `gradient`. J is with respect to
  /// perturbations of the point.
  void add_curvature(std::size_t i, const int* offset, const HessianPlace* place, const Row& w, Jacobians& J,
                     double* gradient, double* H) const {
    Matrix<Types::sum_of_dofs, Types::sum_of_dofs> C;
    std::apply([&](const auto*... x) { blocks_[i].residual.curvature(*x..., w, C); }, points(i));
    add_block_curvature(shape(offset), place, data(J).data(), charts(i).data(), w.data(), C.data(), gradient, H);
  }

  /// Adds the Hessian of wᵀ r, where dual(r, w) computes w. If the residual implements second derivatives, w is held
  /// constant. r and J are then set, J with respect to perturbations of the point; see add_curvature(). Otherwise uses
  /// central differences of Jᵀ w(r).
  template <class Dual>
  void add_second_derivatives(std::size_t i, const int* offset, const HessianPlace* place, Dual dual, Row& r,
                              Jacobians& J, double* gradient, double* H) const {
    if constexpr (kCurvature) {
      Row w;
      linearize_at(i, points(i), offset, r, J);
      dual(r, w);
      add_curvature(i, offset, place, w, J, gradient, H);
    } else {
      difference_gradient(i, offset, place, dual, H);
    }
  }

  /// Adds central differences of the block's gradient Jᵀ w with respect to all its unknowns; dual(r, w) computes w.
  template <class Dual>
  void difference_gradient(std::size_t i, const int* offset, const HessianPlace* place, Dual dual, double* H) const {
    const auto near = [&](int state, int k, double step, double* gradient) {
      auto p = points(i);
      auto charts = this->charts(i);
      static_for<kArity>([&]<int S>() {
        if (S != state) return;
        State<S> moved;
        typename State<S>::Jacobian chart;
        std::get<S>(stores_)->perturbed_point(blocks_[i].slots[S], k, step, moved, chart);
        std::get<S>(p) = &moved;
        charts[S] = chart.data();
        gradient_at(i, p, charts.data(), offset, dual, gradient);
      });
    };
    add_difference_hessian(shape(offset), place, near, H);
  }
  template <class Dual>
  [[gnu::noinline]] void gradient_at(std::size_t i, const typename Types::Points& p, const double* const* charts,
                                     const int* offset, Dual& dual, double* gradient) const {
    Row r, w;
    Jacobians J;
    linearize_at(i, p, offset, r, J);
    dual(r, w);
    block_gradient(shape(offset), data(J).data(), charts, w.data(), gradient);
  }

  std::array<const R*, kBatch> residuals(const Blocks& blocks) const {
    std::array<const R*, kBatch> result;
    for (std::size_t b = 0; b < kBatch; ++b) result[b] = &blocks_[blocks[b]].residual;
    return result;
  }
  auto states(const Blocks& blocks) const {
    typename Batched<R>::States result;
    static_for<kArity>([&]<int S>() {
      for (std::size_t b = 0; b < kBatch; ++b) result[S][b] = std::get<S>(points(blocks[b]));
    });
    return result;
  }

  struct BlockData {
    R residual;
    std::array<int, kArity> slots, ids;  // of each state: slot in its store, ID of its variable
  };
  Stores stores_;
  std::vector<BlockData> blocks_;

 private:
  /// One compiled copy of the residual for all loops of the pool. The cost of the call is negligible; inlining would
  /// dominate the compile time of a problem.
  template <class Points>
  [[gnu::noinline]] void linearize_at(std::size_t i, const Points& p, const int* offset, Row& r, Jacobians& J) const {
    [&]<int... S>(std::integer_sequence<int, S...>) {
      blocks_[i].residual(*std::get<S>(p)..., r, (offset[S] >= 0 ? &std::get<S>(J) : nullptr)...);
    }
    (std::make_integer_sequence<int, kArity>{});
  }
};

}  // namespace tandem::detail
