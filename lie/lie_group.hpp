#pragma once

#include <concepts>

#include <tandem/lie/types.hpp>

namespace tandem {

/// Requirements on the state of a variable. Conventions for all groups (Solà et al. 2018, "A micro Lie theory"):
///
/// Tangent vectors put translation first: δ = [ρ; θ] in m and rad. Perturbations are on the right, X ⊕ δ = X Exp(δ).
/// All Jacobians refer to right perturbations.
///
///   Jl(δ), Jr(δ)          left and right Jacobian of Exp: Exp(δ + ε) ≈ Exp(Jl(δ) ε) Exp(δ) = Exp(δ) Exp(Jr(δ) ε)
///   Ad(X)                 adjoint: Ad(X) v = vee(X hat(v) X⁻¹)
///   angle(v)              rotation angle of a tangent [rad]; 0 for groups without rotation
///   act_jacobian(p)       ∂act(X ⊕ δ, p)/∂δ
///   act_point_jacobian()  ∂act(X, p)/∂p; does not depend on p, because the action is affine
///
/// Member constants: `dof` (tangent dimension), `matrix_size` (rows of matrix() and hat()), `point_dim` (dimension of
/// the points that act() takes). Member types: `Scalar`, `Tangent`, `Jacobian` (dof × dof), `AlgebraMatrix`. The
/// default constructor gives the identity. `Rebind<S>` and `cast<S>()` give the same group over another scalar, e.g.
/// for automatic differentiation.
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

/// True if X is the group G over any scalar. Residuals constrain their states by this concept, so that the same code
/// accepts doubles and dual numbers.
template <class X, class G>
concept Over = LieGroup<X> && std::same_as<typename X::template Rebind<typename G::Scalar>, G>;

}  // namespace tandem
