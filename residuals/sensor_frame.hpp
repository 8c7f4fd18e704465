#pragma once

#include <string>
#include <string_view>

#include <tandem/lie/error.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Where a sensor on the chaser sees the target [m, in the sensor's frame]:  p = t((C B)⁻¹ (T F)).
/// C is the chaser's pose, B the sensor in its body; the target T is a pose or a point, `beacon` is t(F) in its body.
/// Jc and Jt are dp/dC and dp/dT, each filled when not null.
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
  if (Jc) Jc->noalias() = -to_sensor.rotation().matrix() * C::identity().act_jacobian(in_body);
  if (Jt) Jt->noalias() = (to_sensor.rotation() * to_body.rotation()).matrix() * t.act_jacobian(f);
  return to_sensor.act(in_body);
}
// Compiled once, in sensor_frame.cpp.
extern template Vector<3> in_sensor_frame(const SE3&, const SE3&, const SE3&, const Vector<3>&, RowsBy<3, SE3>*,
                                          RowsBy<3, SE3>*);
extern template Vector<3> in_sensor_frame(const SE3&, const R3&, const SE3&, const Vector<3>&, RowsBy<3, SE3>*,
                                          RowsBy<3, R3>*);
extern template Vector<2> in_sensor_frame(const SE2&, const SE2&, const SE2&, const Vector<2>&, RowsBy<2, SE2>*,
                                          RowsBy<2, SE2>*);
extern template Vector<2> in_sensor_frame(const SE2&, const Rn<2>&, const SE2&, const Vector<2>&, RowsBy<2, SE2>*,
                                          RowsBy<2, Rn<2>>*);

/// What a sensor measures of p: r = h(p), where h(p, by_p) fills dh/dp when its pointer is not null, and its Jacobians.
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

/// Throws Error where p is within a nanometre of the sensor: ranges have no slope there, and bearings no direction.
template <int n, class S>
void check_apart(const Vector<n, S>& p, std::string_view who) {
  if (p.squaredNorm() < 1e-18)
    throw Error(std::string(who) + ": undefined with the target at the sensor; start the two apart");
}

}  // namespace tandem
