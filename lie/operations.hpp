#pragma once

#include <tandem/lie/lie_group.hpp>

namespace tandem {

/// Inverse left and right Jacobians at v. The right one is derived from the left one if the group has `opposite`.
template <LieGroup G>
struct InverseJacobians {
  typename G::Jacobian left, right;

  explicit InverseJacobians(const typename G::Tangent& v) : left(G::Jl_inverse(v)) {
    if constexpr (requires { G::opposite(left); }) {
      right = G::opposite(left);
    } else {
      right = G::Jr_inverse(v);
    }
  }
};

/// Returns a b, where a and b are Jacobians of Exp, their inverses or adjoints. Uses the group's block structure if the
/// group has `product`.
template <LieGroup G>
typename G::Jacobian multiply(const typename G::Jacobian& a, const typename G::Jacobian& b) {
  if constexpr (requires { G::product(a, b); }) {
    return G::product(a, b);
  } else {
    return a * b;
  }
}

// Operations of a group (Solà et al. 2018, §III). Each fills the Jacobians whose pointers are not null.

template <LieGroup G>
G compose(const G& x, const G& y, typename G::Jacobian* Jx = nullptr, typename G::Jacobian* Jy = nullptr) {
  if (Jx) *Jx = y.inverse().Ad();
  if (Jy) Jy->setIdentity();
  return x * y;
}

template <LieGroup G>
G inverse(const G& x, typename G::Jacobian* Jx = nullptr) {
  if (Jx) *Jx = -x.Ad();
  return x.inverse();
}

/// Returns X⁻¹ Y.
template <LieGroup G>
G between(const G& x, const G& y, typename G::Jacobian* Jx = nullptr, typename G::Jacobian* Jy = nullptr) {
  const G z = x.inverse() * y;
  if (Jx) *Jx = -z.inverse().Ad();
  if (Jy) Jy->setIdentity();
  return z;
}

template <LieGroup G>
G Exp(const typename G::Tangent& v, typename G::Jacobian* Jv = nullptr) {
  if (Jv) *Jv = G::Jr(v);
  return G::Exp(v);
}

template <LieGroup G>
typename G::Tangent Log(const G& x, typename G::Jacobian* Jx = nullptr) {
  const typename G::Tangent v = x.Log();
  if (Jx) *Jx = G::Jr_inverse(v);
  return v;
}

/// Returns X ⊕ v = X Exp(v), the retraction.
template <LieGroup G>
G plus(const G& x, const typename G::Tangent& v, typename G::Jacobian* Jx = nullptr,
       typename G::Jacobian* Jv = nullptr) {
  const G e = G::Exp(v);
  if (Jx) *Jx = e.inverse().Ad();
  if (Jv) *Jv = G::Jr(v);
  return x * e;
}

/// Returns Y ⊖ X = Log(X⁻¹ Y).
template <LieGroup G>
typename G::Tangent minus(const G& y, const G& x, typename G::Jacobian* Jy = nullptr,
                          typename G::Jacobian* Jx = nullptr) {
  const typename G::Tangent v = (x.inverse() * y).Log();
  if (Jy) *Jy = G::Jr_inverse(v);
  if (Jx) *Jx = -G::Jl_inverse(v);
  return v;
}

/// Applies the group action to a point.
template <LieGroup G>
Vector<G::point_dim, typename G::Scalar> act(const G& x, const Vector<G::point_dim, typename G::Scalar>& p,
                                             Matrix<G::point_dim, G::dof, typename G::Scalar>* Jx = nullptr,
                                             Matrix<G::point_dim, G::point_dim, typename G::Scalar>* Jp = nullptr) {
  if (Jx) *Jx = x.act_jacobian(p);
  if (Jp) *Jp = x.act_point_jacobian();
  return x.act(p);
}

/// Returns X ⊕ s (Y ⊖ X), the geodesic from X (s = 0) to Y (s = 1). Values of s outside [0, 1] extrapolate.
template <LieGroup G>
G interpolate(const G& x, const G& y, const typename G::Scalar& s, typename G::Jacobian* Jx = nullptr,
              typename G::Jacobian* Jy = nullptr) {
  const typename G::Tangent d = minus(y, x), sd = s * d;
  const G step = G::Exp(sd);
  if (Jx || Jy) {
    const typename G::Jacobian K = s * G::Jr(sd);
    const InverseJacobians<G> at_d(d);
    if (Jx) *Jx = step.inverse().Ad() - multiply<G>(K, at_d.left);
    if (Jy) *Jy = multiply<G>(K, at_d.right);
  }
  return x * step;
}

}  // namespace tandem
