#pragma once

#include <concepts>
#include <string_view>
#include <tuple>

#include <tandem/lie/lie_group.hpp>

namespace tandem {

/// r and J of a residual with N rows over the state type X, whatever its scalar.
template <int N, class X>
using Rows = Vector<N, typename X::Scalar>;
template <int N, class X>
using RowsBy = Matrix<N, X::dof, typename X::Scalar>;

namespace detail {

template <class R, class States>
struct IsResidual;
template <class R, class... Xs>
struct IsResidual<R, std::tuple<Xs...>> {
  static constexpr bool value = requires(const R& f, const Xs&... x, Vector<R::dim>& r, RowsBy<R::dim, Xs>*... J) {
    f(x..., r, J...);
  };
};

}  // namespace detail

/// What joins a problem: geometry only, no noise, no bounds, no keys. A struct with its measurement and
///
///   static constexpr std::string_view name;   what messages call it
///   static constexpr int dim;                 rows of the residual
///   using States = std::tuple<…>;             the groups it reads
///   void operator()(const X&…, Vector<dim>& r, Matrix<dim, X::dof>* J… = nullptr) const;
///
/// which sets r and each J that is not null, the Jacobian with respect to a right perturbation of that state. It does
/// not allocate, and it may be called from two threads at once. Where the residual is undefined it throws Error: solvers then shorten the step.
///
/// Residuals of this library also take their states over any scalar (`Over<X, SE3>`), which automatic differentiation
/// needs and nothing else; a residual of your own may be written for double alone.
template <class R>
concept Residual = requires {
  { R::name } -> std::convertible_to<std::string_view>;
  requires(R::dim > 0);
  typename R::States;
}
&&detail::IsResidual<R, typename R::States>::value;

}  // namespace tandem
