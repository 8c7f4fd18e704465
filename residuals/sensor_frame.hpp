#pragma once

#include <string>
#include <string_view>

#include <tandem/lie/error.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

namespace detail {

/// Returns the rotation of a pose, and any other group element itself.
template <LieGroup X>
decltype(auto) rotation_part(const X& x) {
  if constexpr (requires { x.rotation(); }) {
    return x.rotation();
  } else {
    return (x);
  }
}

}  // namespace detail

/// Returns the target's position in the frame of a sensor on the chaser [m]:  p = t((C B)⁻¹ (T F)). C is the pose of
/// the chaser and B the pose of the sensor in its body. The target T is a pose or a point; `beacon` is t(F) in its
/// body. Other groups act on points in the same way. Fills Jc = ∂p/∂C and Jt = ∂p/∂T if not null.
template <LieGroup C, LieGroup T, Over<typename C::template Rebind<double>> Mount>
Vector<C::point_dim, typename C::Scalar> in_sensor_frame(const C& c, const T& t, const Mount& B,
                                                         const Vector<C::point_dim>& beacon,
                                                         RowsBy<C::point_dim, C>* Jc = nullptr,
                                                         RowsBy<C::point_dim, T>* Jt = nullptr) {
  using S = typename C::Scalar;
  const Vector<C::point_dim, S> f = beacon.template cast<S>();
  const C to_body = c.inverse();
  const Vector<C::point_dim, S> in_body = to_body.act(t.act(f));
  const C to_sensor = B.inverse().template cast<S>();
  const auto& sensor = detail::rotation_part(to_sensor);
  if (Jc) Jc->noalias() = -sensor.act_point_jacobian() * C::identity().act_jacobian(in_body);
  if (Jt) Jt->noalias() = (sensor * detail::rotation_part(to_body)).act_point_jacobian() * t.act_jacobian(f);
  return to_sensor.act(in_body);
}
// Instantiated in sensor_frame.cpp.
extern template Vector<3> in_sensor_frame(const SE3&, const SE3&, const SE3&, const Vector<3>&, RowsBy<3, SE3>*,
                                          RowsBy<3, SE3>*);
extern template Vector<3> in_sensor_frame(const SE3&, const R3&, const SE3&, const Vector<3>&, RowsBy<3, SE3>*,
                                          RowsBy<3, R3>*);
extern template Vector<2> in_sensor_frame(const SE2&, const SE2&, const SE2&, const Vector<2>&, RowsBy<2, SE2>*,
                                          RowsBy<2, SE2>*);
extern template Vector<2> in_sensor_frame(const SE2&, const Rn<2>&, const SE2&, const Vector<2>&, RowsBy<2, SE2>*,
                                          RowsBy<2, Rn<2>>*);

/// Evaluates r = h(p) and its Jacobians, where p is the position of in_sensor_frame(). h(p, by_p) fills ∂h/∂p if by_p
/// is not null.
template <int dim, LieGroup C, LieGroup T, Over<typename C::template Rebind<double>> Mount, class H>
void observe(const C& c, const T& t, const Mount& B, const Vector<C::point_dim>& beacon, const H& h, Rows<dim, C>& r,
             RowsBy<dim, C>* Jc, RowsBy<dim, T>* Jt) {
  constexpr int n = C::point_dim;
  using S = typename C::Scalar;
  RowsBy<n, C> p_by_c;
  RowsBy<n, T> p_by_t;
  const Vector<n, S> p = in_sensor_frame(c, t, B, beacon, Jc ? &p_by_c : nullptr, Jt ? &p_by_t : nullptr);
  Matrix<dim, n, S> by_p;
  r = h(p, Jc || Jt ? &by_p : nullptr);
  if (Jc) Jc->noalias() = by_p * p_by_c;
  if (Jt) Jt->noalias() = by_p * p_by_t;
}

/// Throws UndefinedResidualError if p is within 1 nm of the sensor, where range and bearing are not differentiable.
/// `who` names the residual.
template <int n, class S>
void check_not_at_sensor(const Vector<n, S>& p, std::string_view who) {
  if (p.squaredNorm() < 1e-18)
    throw UndefinedResidualError(
        std::string(who) + ": undefined if the target is at the sensor; use an initial guess that separates them");
}

}  // namespace tandem
