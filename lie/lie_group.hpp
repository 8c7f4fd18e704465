#pragma once

#include <concepts>

#include <tandem/lie/types.hpp>

namespace tandem {

/// What every state of a problem must offer. Conventions, for all groups (Solà et al. 2018, "A micro Lie theory"):
///
///   - tangent vectors put translation first, δ = [ρ; θ] in m and rad;
///   - perturbations are on the right, X ⊕ δ = X Exp(δ), and so are all Jacobians;
///   - Jl(δ), Jr(δ) are the left and right Jacobians of Exp: Exp(δ + ε) ≈ Exp(Jl(δ) ε) Exp(δ) = Exp(δ) Exp(Jr(δ) ε);
///   - Ad(X) v = vee(X hat(v) X⁻¹);
///   - act_jacobian(p) is d act(X ⊕ δ, p)/dδ, act_point_jacobian() is d act(X, p)/dp (the action is affine in p).
///
/// Members: `dof` (tangent dimension), `matrix_size` (of matrix(), hat), `point_dim` (of act), `Scalar`, `Tangent`,
/// `Jacobian` (dof × dof), a default constructor (the identity), `Rebind<S>` and `cast<S>()` (the same group over another scalar, e.g. for automatic differentiation).
template <class G>
concept LieGroup = std::default_initializable<G> &&
    requires(const G& x, const typename G::Tangent& v, const typename G::AlgebraMatrix& m,
             const Vector<G::point_dim, typename G::Scalar>& p) {
  typename G::Scalar;
  requires(G::dof > 0);
  { G::identity() } -> std::same_as<G>;
  { x* x } -> std::same_as<G>;
  { x.inverse() } -> std::same_as<G>;
  { G::Exp(v) } -> std::same_as<G>;
  { x.Log() } -> std::same_as<typename G::Tangent>;
  { x.Ad() } -> std::same_as<typename G::Jacobian>;
  { G::Jl(v) } -> std::same_as<typename G::Jacobian>;
  { G::Jr(v) } -> std::same_as<typename G::Jacobian>;
  { G::Jl_inverse(v) } -> std::same_as<typename G::Jacobian>;
  { G::Jr_inverse(v) } -> std::same_as<typename G::Jacobian>;
  { G::angle(v) } -> std::same_as<typename G::Scalar>;
  { G::hat(v) } -> std::same_as<typename G::AlgebraMatrix>;
  { G::vee(m) } -> std::same_as<typename G::Tangent>;
  { x.matrix() } -> std::same_as<typename G::AlgebraMatrix>;
  { x.act(p) } -> std::same_as<Vector<G::point_dim, typename G::Scalar>>;
  { x.act_jacobian(p) } -> std::same_as<Matrix<G::point_dim, G::dof, typename G::Scalar>>;
  { x.act_point_jacobian() } -> std::same_as<Matrix<G::point_dim, G::point_dim, typename G::Scalar>>;
};

/// X is the group G, over any scalar: residuals take their states as this, so that the same code serves doubles and
/// dual numbers.
template <class X, class G>
concept Over = LieGroup<X> && std::same_as<typename X::template Rebind<typename G::Scalar>, G>;

}  // namespace tandem
