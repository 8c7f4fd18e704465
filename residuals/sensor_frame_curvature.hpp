#pragma once

#include <tandem/residuals/sensor_frame.hpp>

namespace tandem::detail {

/// The second derivative of uᵀ (Exp(θ) p + Jl(θ) ρ) by the perturbation [ρ; …; θ], at 0: of a pose that acts on a point
/// p, u in its body. That of its inverse, uᵀ (Exp(−θ) p − Jr(θ) ρ), is the same.
template <int K>
Matrix<3 * K + 3, 3 * K + 3> curvature_of_action(const Vector<3>& u, const Vector<3>& p) {
  constexpr int theta = 3 * K;
  Matrix<3 * K + 3, 3 * K + 3> H = Matrix<3 * K + 3, 3 * K + 3>::Zero();
  const Matrix<3, 3> mixed = 0.5 * skew(u), outer = 0.5 * u * p.transpose();
  H.template block<3, 3>(0, theta) = mixed;
  H.template block<3, 3>(theta, 0) = mixed.transpose();
  H.template block<3, 3>(theta, theta) = outer + outer.transpose() - u.dot(p) * Matrix<3, 3>::Identity();
  return H;
}

/// That of a target T, v = R u in the world; points move linearly.
template <int K>
Matrix<3 * K + 3, 3 * K + 3> curvature_of_target(const BasicSEK3<K, double>& t, const Vector<3>& v,
                                                 const Vector<3>& beacon) {
  return curvature_of_action<K>(t.rotation().inverse().act(v), beacon);
}
inline Matrix<3, 3> curvature_of_target(const R3&, const Vector<3>&, const Vector<3>&) { return Matrix<3, 3>::Zero(); }

/// Second derivatives of wᵀ p, p that of in_sensor_frame, by right perturbations of C and T together.
template <int K, LieGroup T>
void curvature_in_sensor_frame(const BasicSEK3<K, double>& c, const T& t, const BasicSEK3<K, double>& B,
                               const Vector<3>& beacon, const Vector<3>& w,
                               Matrix<3 * K + 3 + T::dof, 3 * K + 3 + T::dof>& H) {
  constexpr int n = 3 * K + 3, m = T::dof;
  const Matrix<3, 3> from_world = c.rotation().matrix().transpose();
  const Vector<3> in_body = c.inverse().act(t.act(beacon)), u = B.rotation().act(w);
  const Matrix<3, m> by_t = from_world * t.act_jacobian(beacon);
  Matrix<n, m> mixed = Matrix<n, m>::Zero();  // what C's rotation makes of T's motion: −uᵀ (θ × by_t τ)
  mixed.template bottomRows<3>() = skew(u) * by_t;
  H.template topLeftCorner<n, n>() = curvature_of_action<K>(u, in_body);
  H.template topRightCorner<n, m>() = mixed;
  H.template bottomLeftCorner<m, n>() = mixed.transpose();
  H.template bottomRightCorner<m, m>() = curvature_of_target(t, c.rotation().act(u), beacon);
}

/// Those of wᵀ h(p), as observe() has it, of the gradient of wᵀ h by p and its second derivatives there.
template <int K, LieGroup T>
void curvature_of_observed(const BasicSEK3<K, double>& c, const T& t, const BasicSEK3<K, double>& B,
                           const Vector<3>& beacon, const Vector<3>& by_p, const Matrix<3, 3>& of_p,
                           Matrix<3 * K + 3 + T::dof, 3 * K + 3 + T::dof>& H) {
  constexpr int n = 3 * K + 3, m = T::dof;
  Matrix<3, n> by_c;
  Matrix<3, m> by_t;
  in_sensor_frame(c, t, B, beacon, &by_c, &by_t);
  curvature_in_sensor_frame(c, t, B, beacon, by_p, H);
  Matrix<3, n + m> J;
  J << by_c, by_t;
  H += J.transpose().lazyProduct((of_p * J).eval());
}
// Compiled once, in sensor_frame.cpp.
extern template void curvature_in_sensor_frame(const SE3&, const SE3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                               Matrix<12, 12>&);
extern template void curvature_in_sensor_frame(const SE3&, const R3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                               Matrix<9, 9>&);
extern template void curvature_of_observed(const SE3&, const SE3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                           const Matrix<3, 3>&, Matrix<12, 12>&);
extern template void curvature_of_observed(const SE3&, const R3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                           const Matrix<3, 3>&, Matrix<9, 9>&);

}  // namespace tandem::detail
