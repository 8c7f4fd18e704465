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
struct IsResidual {
  static constexpr bool value = false;
};
template <class R, LieGroup... Xs>
struct IsResidual<R, std::tuple<Xs...>> {
  static constexpr bool value = requires(const R& f, const Xs&... x, Vector<R::dim>& r, RowsBy<R::dim, Xs>*... J) {
    f(x..., r, J...);
  };
};

template <class R, class States>
struct CurvatureOf;
template <class R, class... Xs>
struct CurvatureOf<R, std::tuple<Xs...>> {
  static constexpr int size = (Xs::dof + ...);
  static constexpr bool known = requires(const R& f, const Xs&... x, const Vector<R::dim>& w, Matrix<size, size>& H) {
    f.curvature(x..., w, H);
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
/// not allocate, and it may be called from several threads at once. Where the residual is undefined it throws Error:
/// solvers then shorten the step.
///
/// It may also give its second derivatives, contracted with w, by right perturbations of all states together (symmetric,
/// in the order of States): Σ w_k ∂²r_k, of Σ dof × Σ dof. Exact Hessians are made by differences of the gradient without:
///
///   void curvature(const X&…, const Vector<dim>& w, Matrix<n, n>& H) const;
///
/// or say that it has none, being linear in states that are all vectors:
///
///   static constexpr bool linear = true;
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

/// A residual that gives its second derivatives.
template <class R>
concept HasCurvature = Residual<R> && detail::CurvatureOf<R, typename R::States>::known;

/// A residual that says it is linear.
template <class R>
concept IsLinear = Residual<R> && requires {
  requires R::linear;
};

}  // namespace tandem
