#pragma once

#include <concepts>
#include <string_view>
#include <tuple>

#include <tandem/lie/lie_group.hpp>

namespace tandem {

/// Types of r and J for a residual with N rows and the state type X, over the scalar of X.
template <int N, class X>
using Rows = Vector<N, typename X::Scalar>;
template <int N, class X>
using RowsBy = Matrix<N, X::dof, typename X::Scalar>;

namespace detail {

/// Limits: dofs of one state, rows of one residual, states of one residual.
inline constexpr int kMaxDofs = 64, kMaxRows = 64, kMaxStates = 16;

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

/// Requirements on a residual: a struct with a measurement and its geometry. Noise, bounds and loss are given when it
/// joins a problem. Members:
///
///   static constexpr std::string_view name;   name in messages
///   static constexpr int dim;                 number of rows
///   using States = std::tuple<…>;             groups of the states that it reads
///   void operator()(const X&…, Vector<dim>& r, Matrix<dim, X::dof>* J… = nullptr) const;
///
/// The call operator sets r. It sets each J that is not null to the Jacobian with respect to a right perturbation of
/// that state. It must not allocate and must be safe to call from several threads. It throws
/// UndefinedResidualError with the reason where the residual is undefined; solvers then shorten the step.
///
/// Optional second derivatives, Σ w_k ∂²r_k with respect to right perturbations of all states in the order of States
/// (symmetric, n = Σ dof). Without this member, exact Hessians use differences of the gradient.
///
///   void curvature(const X&…, const Vector<dim>& w, Matrix<n, n>& H) const;
///
/// Optional declaration of a linear residual; all its states must be vectors:
///
///   static constexpr bool linear = true;
///
/// Tandem's residuals accept states over any scalar (`Over<X, SE3>`). Only automatic differentiation needs this;
/// user-defined residuals may support double alone.
template <class R>
concept Residual = requires {
  { R::name } -> std::convertible_to<std::string_view>;
  requires(R::dim > 0);
  typename R::States;
}
&&detail::IsResidual<R, typename R::States>::value;

/// Residuals with second derivatives.
template <class R>
concept HasCurvature = Residual<R> && detail::CurvatureOf<R, typename R::States>::known;

/// Residuals that are declared linear.
template <class R>
concept IsLinear = Residual<R> && requires {
  requires R::linear;
};

}  // namespace tandem
