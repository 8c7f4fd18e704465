#pragma once

#include <concepts>

#include <tandem/residuals/sensor_frame.hpp>

namespace tandem::detail {

template <class G>
inline constexpr bool is_sek3 = false;
template <int K>
inline constexpr bool is_sek3<BasicSEK3<K, double>> = true;
/// Chasers C and targets T that the functions below support.
template <class C, class T>
concept HasSightCurvature = is_sek3<C> &&(is_sek3<T> || std::same_as<T, R3>);

/// Returns the Hessian of uᵀ (Exp(θ) p + Jl(θ) ρ) with respect to the perturbation [ρ; …; θ] at 0. This is the action
/// of a pose on a point p, with u in body axes. The inverse action uᵀ (Exp(−θ) p − Jr(θ) ρ) has the same Hessian.
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

/// Returns the Hessian for a target T, with v = R u in world axes. It is zero for points, whose motion is linear.
template <int K>
Matrix<3 * K + 3, 3 * K + 3> curvature_of_target(const BasicSEK3<K, double>& t, const Vector<3>& v,
                                                 const Vector<3>& beacon) {
  return curvature_of_action<K>(t.rotation().inverse().act(v), beacon);
}
inline Matrix<3, 3> curvature_of_target(const R3&, const Vector<3>&, const Vector<3>&) { return Matrix<3, 3>::Zero(); }

/// Fills H with the Hessian of wᵀ p with respect to right perturbations of C and T, where p is the position of
/// in_sensor_frame().
template <int K, LieGroup T>
void curvature_in_sensor_frame(const BasicSEK3<K, double>& c, const T& t, const BasicSEK3<K, double>& B,
                               const Vector<3>& beacon, const Vector<3>& w,
                               Matrix<3 * K + 3 + T::dof, 3 * K + 3 + T::dof>& H) {
  constexpr int n = 3 * K + 3, m = T::dof;
  const Matrix<3, 3> from_world = c.rotation().matrix().transpose();
  const Vector<3> in_body = c.inverse().act(t.act(beacon)), u = B.rotation().act(w);
  const Matrix<3, m> by_t = from_world * t.act_jacobian(beacon);
  Matrix<n, m> mixed = Matrix<n, m>::Zero();  // rotation θ of C and motion τ of T: −uᵀ (θ × by_t τ)
  mixed.template bottomRows<3>() = skew(u) * by_t;
  H.template topLeftCorner<n, n>() = curvature_of_action<K>(u, in_body);
  H.template topRightCorner<n, m>() = mixed;
  H.template bottomLeftCorner<m, n>() = mixed.transpose();
  H.template bottomRightCorner<m, m>() = curvature_of_target(t, c.rotation().act(u), beacon);
}

/// Fills H with the Hessian of wᵀ h(p), where h is the measurement of observe(). `by_p` and `of_p` are the gradient and
/// Hessian of wᵀ h with respect to p.
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
// Instantiated in sensor_frame.cpp.
extern template void curvature_in_sensor_frame(const SE3&, const SE3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                               Matrix<12, 12>&);
extern template void curvature_in_sensor_frame(const SE3&, const R3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                               Matrix<9, 9>&);
extern template void curvature_of_observed(const SE3&, const SE3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                           const Matrix<3, 3>&, Matrix<12, 12>&);
extern template void curvature_of_observed(const SE3&, const R3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                           const Matrix<3, 3>&, Matrix<9, 9>&);

}  // namespace tandem::detail
