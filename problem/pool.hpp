#pragma once

#include <array>
#include <string_view>
#include <tuple>
#include <vector>

#include <tandem/lie/static_for.hpp>
#include <tandem/problem/state_store.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem::detail {

/// Where a block's contributions go in the solver's arrays: compiled once from the pattern (see Program).
struct HessianPlace {
  int position = -1;  ///< of the block's first entry in the CSC values
  int stride = 0;     ///< from one column of it to the next
};
struct PoolPlacement {
  std::vector<int> offset;            ///< blocks × arity: the state's first unknown, −1 when it is fixed
  std::vector<HessianPlace> hessian;  ///< blocks × arity (arity + 1) / 2: pairs (a, b ≤ a) at a (a + 1) / 2 + b
  std::vector<int> jacobian;          ///< blocks: first entry in the values of the constraint Jacobian (hard pools)
};

/// All blocks of one residual type and role, evaluated in one loop: one virtual call a pool.
class PoolBase {
 public:
  virtual ~PoolBase() = default;
  virtual std::string_view name() const = 0;
  virtual int dim() const = 0;
  virtual int arity() const = 0;
  virtual int size() const = 0;
  /// Ids of the variables that block `i` reads, `arity()` of them.
  virtual const int* variables(int i) const = 0;
  /// The last block takes the place of block `i`.
  virtual void remove(int i) = 0;
  /// Adds ‖W J v‖² and ‖W J diag(v)‖² over the blocks; hard pools take the square root of W's diagonal² from
  /// `row_weights`, soft ones have their own.
  virtual void add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                             double& scale) const = 0;
  /// Adds the block's exact second derivatives to the Hessian, by central differences of the closed-form gradient of
  /// `factor` times the cost (soft pools) or of multipliersᵀ c (hard pools).
  virtual void add_exact_hessian(const PoolPlacement& place, double factor, const double* multipliers,
                                 double* H) const = 0;
};

/// What every pool of residual R has: the blocks' residuals and states, and their evaluation at the point.
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
  int size() const override { return static_cast<int>(residuals_.size()); }
  const int* variables(int i) const override { return ids_[static_cast<std::size_t>(i)].data(); }

 protected:
  template <class Sequence>
  struct Tuples;
  template <int... S>
  struct Tuples<std::integer_sequence<int, S...>> {
    using Stores = std::tuple<StateStore<State<S>>*...>;
    using Points = std::tuple<const State<S>*...>;
    using Jacobians = std::tuple<Matrix<kDim, State<S>::dof>...>;
    static constexpr std::array<int, kArity> dofs{State<S>::dof...};
  };
  using Types = Tuples<std::make_integer_sequence<int, kArity>>;
  using Stores = typename Types::Stores;
  using Jacobians = typename Types::Jacobians;
  using Row = Vector<kDim>;

  explicit BlockPool(const Stores& stores) : stores_(stores) {}

  void add_block(const R& residual, const std::array<int, kArity>& slots) {
    residuals_.push_back(residual);
    slots_.push_back(slots);
    std::array<int, kArity> ids;
    static_for<kArity>([&]<int S>() { ids[S] = std::get<S>(stores_)->id[std::size_t(slots[S])]; });
    ids_.push_back(ids);
  }
  template <class T>
  static void remove_from(std::vector<T>& v, int i) {
    v[static_cast<std::size_t>(i)] = v.back();
    v.pop_back();
  }
  void remove_block(int i) {
    remove_from(residuals_, i);
    remove_from(slots_, i);
    remove_from(ids_, i);
  }

  typename Types::Points points(std::size_t i) const {
    typename Types::Points p;
    static_for<kArity>([&]<int S>() { std::get<S>(p) = &std::get<S>(stores_)->point[std::size_t(slots_[i][S])]; });
    return p;
  }

  [[gnu::noinline]] void value(std::size_t i, Row& r) const {
    std::apply([&](const auto*... x) { residuals_[i](*x..., r); }, points(i));
  }

  /// r, and J with respect to the unknowns of the states whose offset is not negative.
  void linearize(std::size_t i, const int* offset, Row& r, Jacobians& J) const {
    linearize_at(i, points(i), offset, r, J);
    static_for<kArity>([&]<int S>() {
      const auto& store = *std::get<S>(stores_);
      if (offset[S] >= 0 && store.charted)  // the chain through Jr(δ), here and nowhere else
        std::get<S>(J) = (std::get<S>(J) * store.chart[std::size_t(slots_[i][S])]).eval();
    });
  }

  /// Adds ‖J v‖² and ‖J diag(v)‖² of one block whose Jacobians are whitened.
  static void add_block_stiffness(const int* offset, const Jacobians& J, const double* v, double& along,
                                  double& scale) {
    Row Jv = Row::Zero();
    static_for<kArity>([&]<int A>() {
      if (offset[A] < 0) return;
      const Eigen::Map<const Vector<State<A>::dof>> part(v + offset[A]);
      Jv += std::get<A>(J) * part;
      scale += (std::get<A>(J) * part.asDiagonal()).squaredNorm();
    });
    along += Jv.squaredNorm();
  }

  /// H += w Jaᵀ Jb for every pair of free states, straight into the solver's matrix.
  static void add_products(const int* offset, const HessianPlace* place, double weight, const Jacobians& J, double* H) {
    static_for<kArity>([&]<int A>() {
      if (offset[A] < 0) return;
      const auto JaT = (weight * std::get<A>(J).transpose()).eval();
      static_for<A + 1>([&]<int B>() {
        if (offset[B] < 0) return;
        constexpr int a = State<A>::dof, b = State<B>::dof;
        const HessianPlace& at = place[A * (A + 1) / 2 + B];
        const Matrix<a, b> product = JaT * std::get<B>(J);
        if (offset[A] >= offset[B]) add_block_at<a, b>(H + at.position, at.stride, product);
        if (A != B && offset[A] <= offset[B])  // both when a block reads one variable twice
          add_block_at<b, a>(H + at.position, at.stride, product.transpose());
      });
    });
  }

  /// Adds to a block of a matrix kept by columns, `stride` apart.
  template <int rows, int columns, class Block>
  static void add_block_at(double* to, int stride, const Block& block) {
    if constexpr (rows == 1) {  // Eigen keeps a single row by rows, and would not step from column to column
      for (int j = 0; j < columns; ++j) to[std::ptrdiff_t(j) * stride] += block(0, j);
    } else {
      Eigen::Map<Matrix<rows, columns>, 0, Eigen::OuterStride<>>(to, Eigen::OuterStride<>(stride)) += block;
    }
  }

  /// Central differences of `gradient(r, J, S)`, the block's gradient by state S, over all its unknowns.
  template <class Gradient>
  void difference_gradient(std::size_t i, const int* offset, const HessianPlace* place, Gradient gradient,
                           double* H) const {
    constexpr double h = 1e-5;  // balances h² truncation and 1e-16/h rounding of a first derivative
    static_for<kArity>([&]<int B>() {
      if (offset[B] < 0) return;
      using X = State<B>;
      auto& store = *std::get<B>(stores_);
      const std::size_t slot = std::size_t(slots_[i][B]);
      auto p = points(i);
      for (int k = 0; k < X::dof; ++k) {
        std::array<Row, 2> r;
        std::array<Jacobians, 2> J;
        for (int side = 0; side < 2; ++side) {
          typename X::Tangent d = store.delta[slot];
          d[k] += side == 0 ? h : -h;
          const X moved = store.value[slot] * X::Exp(d);
          std::get<B>(p) = &moved;
          linearize_at(i, p, offset, r[std::size_t(side)], J[std::size_t(side)]);
          static_for<kArity>([&]<int S>() {
            auto& Js = std::get<S>(J[std::size_t(side)]);
            const auto& s = *std::get<S>(stores_);
            if (offset[S] < 0) return;
            if constexpr (S == B) {
              Js = (Js * X::Jr(d)).eval();
            } else if (s.charted) {
              Js = (Js * s.chart[std::size_t(slots_[i][S])]).eval();
            }
          });
        }
        static_for<kArity>([&]<int A>() {
          if (offset[A] < 0) return;
          const Vector<State<A>::dof> column =
              (gradient.template operator()<A>(r[0], J[0]) - gradient.template operator()<A>(r[1], J[1])) / (2 * h);
          // Every ordered pair is met once from each side: half from each keeps the Hessian symmetric.
          constexpr int a = A > B ? A : B, b = A > B ? B : A;
          const HessianPlace& at = place[a * (a + 1) / 2 + b];
          const bool row_is_A = offset[A] >= offset[B];
          for (int m = 0; m < State<A>::dof; ++m) {
            if constexpr (A == B) {
              H[at.position + k * at.stride + m] += 0.5 * column[m];
              H[at.position + m * at.stride + k] += 0.5 * column[m];
            } else {
              const double v = offset[A] == offset[B] ? column[m] : 0.5 * column[m];
              H[row_is_A ? at.position + k * at.stride + m : at.position + m * at.stride + k] += v;
            }
          }
        });
      }
    });
  }

  Stores stores_;
  std::vector<R> residuals_;
  std::vector<std::array<int, kArity>> slots_, ids_;

 private:
  /// One compiled copy of the residual for the pool's several loops: what the call costs is lost in a block's arithmetic,
  /// what inlining would cost is most of the time that a problem takes to compile.
  template <class Points>
  [[gnu::noinline]] void linearize_at(std::size_t i, const Points& p, const int* offset, Row& r, Jacobians& J) const {
    [&]<int... S>(std::integer_sequence<int, S...>) {
      residuals_[i](*std::get<S>(p)..., r, (offset[S] >= 0 ? &std::get<S>(J) : nullptr)...);
    }
    (std::make_integer_sequence<int, kArity>{});
  }
};

}  // namespace tandem::detail
