#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <new>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <typeinfo>
#include <utility>

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/residuals/batched.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/soft_bound.hpp>

namespace tandem::detail {

struct ResidualFunctions;

/// Functions of a residual that has a batched evaluation; see Batched. `residuals` has kBatch entries and `x` has
/// kBatch entries for each state.
struct BatchFunctions {
  void (*linearize)(const void* const* residuals, const void* const* x, double* r, double* const* J);
  void (*evaluate)(const void* const* residuals, const void* const* x, double* r);
  void (*curvature)(const void* const* residuals, const void* const* x, const double* w, double* C);
};

/// Parts of a SoftBound: the bounded residual and its bounds.
struct BoundedResidual {
  const void* residual;
  const double *lower, *upper;
};

/// A residual type without its C++ type. Pools depend on residuals through this table only. They are therefore compiled
/// once, which keeps the compile time of a problem low. `x` points to the states. Arrays r, w, J[s] and C are aligned
/// to kScratchAlignment bytes.
struct ResidualFunctions {
  std::string_view name;
  const std::type_info* type;
  int dim, arity;
  const int* dofs;  ///< tangent dimension of each state
  bool linear;      ///< see IsLinear

  std::size_t size, alignment;               ///< size and alignment of the residual object [bytes]
  void (*copy)(const void* from, void* to);  ///< constructs a copy
  void (*relocate)(void* from, void* to);    ///< moves to uninitialised memory and destroys the source
  void (*destroy)(void* residual);

  void (*evaluate)(const void* residual, const void* const* x, double* r);
  /// Also computes the Jacobians J[s] with respect to perturbations of the states whose offset is not negative.
  void (*linearize)(const void* residual, const void* const* x, const int* offset, double* r, double* const* J);
  /// Computes the second derivatives. Null if the residual or one of its groups does not implement them.
  void (*curvature)(const void* residual, const void* const* x, const double* w, double* C);
  BatchFunctions batch;  ///< null if there is no batched evaluation

  const ResidualFunctions* bounded;                 ///< the bounded residual of a SoftBound; null for other residuals
  BoundedResidual (*bounds)(const void* residual);  ///< parts of a SoftBound; null for others
};

/// Alignment of the arrays of ResidualFunctions [bytes], enough for every fixed-size Eigen type.
inline constexpr std::size_t kScratchAlignment = 64;

/// Implements the functions of residual R, which has a batched evaluation and reads `arity` states.
template <class R, std::size_t arity>
struct BatchesOf {
  static auto batch_of(const void* const* residuals) {
    std::array<const R*, kBatch> result;
    for (const R*& residual : result) residual = static_cast<const R*>(*residuals++);
    return result;
  }
  static auto states_of(const void* const* x) {
    typename Batched<R>::States result;
    for (auto& state : result)
      for (auto& block : state) block = static_cast<std::remove_reference_t<decltype(block)>>(*x++);
    return result;
  }
  static void linearize(const void* const* residuals, const void* const* x, double* r, double* const* J) {
    std::array<double*, arity> jacobians;
    std::copy_n(J, arity, jacobians.begin());
    Batched<R>::linearize(batch_of(residuals), states_of(x), r, jacobians);
  }
  static void evaluate(const void* const* residuals, const void* const* x, double* r) {
    Batched<R>::evaluate(batch_of(residuals), states_of(x), r);
  }
  static void curvature(const void* const* residuals, const void* const* x, const double* w, double* C) {
    Batched<R>::curvature(batch_of(residuals), states_of(x), w, C);
  }
};

/// Implements the functions of residual R with the states Xs. The sources of common residuals instantiate it once.
template <Residual R, class States = typename R::States,
          class Sequence = std::make_index_sequence<std::tuple_size_v<typename R::States>>>
struct FunctionsOf;
template <Residual R, class... Xs, std::size_t... S>
struct FunctionsOf<R, std::tuple<Xs...>, std::index_sequence<S...>> {
  static constexpr int kDim = R::dim, kArity = sizeof...(Xs), kSumOfDofs = (Xs::dof + ...);
  static constexpr std::array<int, sizeof...(Xs)> kDofs{Xs::dof...};
  static constexpr bool kCurvature = HasCurvature<R> && (HasExpCurvature<Xs> && ...);
  static_assert(std::max({Xs::dof...}) <= kMaxDofs && kDim <= kMaxRows && kArity <= kMaxStates);

  static const R& cast(const void* residual) { return *static_cast<const R*>(residual); }
  // Not defined here, so that sources with an extern template declaration do not instantiate them.
  static void copy(const void* from, void* to);
  static void relocate(void* from, void* to);
  static void destroy(void* residual);
  static void evaluate(const void* residual, const void* const* x, double* r);
  static void linearize(const void* residual, const void* const* x, const int* offset, double* r, double* const* J);
  static void curvature(const void* residual, const void* const* x, const double* w, double* C);
  static constexpr BatchFunctions batch() {
    if constexpr (Batched<R>::exists) {
      using B = BatchesOf<R, sizeof...(Xs)>;
      return {&B::linearize, &B::evaluate, &B::curvature};
    } else {
      return {};
    }
  }

 private:
  /// Creates a matrix without initialising its entries.
  template <int rows, int columns>
  static Matrix<rows, columns>* matrix(double* entries) {
    return ::new (static_cast<void*>(entries)) Matrix<rows, columns>;
  }
};

#define TANDEM_FUNCTIONS_OF                            \
  template <Residual R, class... Xs, std::size_t... S> \
  void FunctionsOf<R, std::tuple<Xs...>, std::index_sequence<S...>>

TANDEM_FUNCTIONS_OF::copy(const void* from, void* to) { std::construct_at(static_cast<R*>(to), cast(from)); }
TANDEM_FUNCTIONS_OF::relocate(void* from, void* to) {
  R* source = static_cast<R*>(from);
  std::construct_at(static_cast<R*>(to), std::move(*source));
  std::destroy_at(source);
}
TANDEM_FUNCTIONS_OF::destroy(void* residual) { std::destroy_at(static_cast<R*>(residual)); }
TANDEM_FUNCTIONS_OF::evaluate(const void* residual, const void* const* x, double* r) {
  cast(residual)(*static_cast<const Xs*>(x[S])..., *matrix<kDim, 1>(r));
}
TANDEM_FUNCTIONS_OF::linearize(const void* residual, const void* const* x, const int* offset, double* r,
                               double* const* J) {
  cast(residual)(*static_cast<const Xs*>(x[S])..., *matrix<kDim, 1>(r),
                 (offset[S] >= 0 ? matrix<kDim, Xs::dof>(J[S]) : nullptr)...);
}
TANDEM_FUNCTIONS_OF::curvature(const void* residual, const void* const* x, const double* w, double* C) {
  if constexpr (kCurvature)
    cast(residual).curvature(*static_cast<const Xs*>(x[S])..., *reinterpret_cast<const Vector<kDim>*>(w),
                             *matrix<kSumOfDofs, kSumOfDofs>(C));
}
#undef TANDEM_FUNCTIONS_OF

template <Residual R>
constexpr ResidualFunctions make_residual_functions();
/// The functions of residual R.
template <Residual R>
inline constexpr ResidualFunctions kResidualFunctions = make_residual_functions<R>();

template <Residual R>
constexpr ResidualFunctions make_residual_functions() {
  using F = FunctionsOf<R>;
  ResidualFunctions f{};
  f.name = R::name;
  f.type = &typeid(R);
  f.dim = F::kDim;
  f.arity = F::kArity;
  f.dofs = F::kDofs.data();
  f.linear = IsLinear<R>;
  f.size = sizeof(R);
  f.alignment = alignof(R);
  f.copy = &F::copy;
  f.relocate = &F::relocate;
  f.destroy = &F::destroy;
  f.evaluate = &F::evaluate;
  f.linearize = &F::linearize;
  if constexpr (F::kCurvature) f.curvature = &F::curvature;
  f.batch = F::batch();
  if constexpr (is_soft_bound<R>) {
    f.bounded = &kResidualFunctions<decltype(R::residual)>;
    f.bounds = [](const void* residual) {
      const R& soft = F::cast(residual);
      return BoundedResidual{&soft.residual, soft.bounds.lower.data(), soft.bounds.upper.data()};
    };
  }
  return f;
}

}  // namespace tandem::detail
