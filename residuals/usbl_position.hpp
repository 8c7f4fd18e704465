#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// The target's position in the frame of a sensor on the chaser [m]:  e = t((C B)⁻¹ (T F)) − z.
/// The target T is a pose or a point (SE3, SE2, R3, R2); of F only the beacon's position matters.
/// Source: Baxter & Teran Espinoza 2025, §III (USBL).
template <LieGroup Chaser = SE3, LieGroup Target = Chaser>
requires(Chaser::point_dim == Target::point_dim) struct UsblPosition {
  static constexpr std::string_view name = "USBL position";
  static constexpr int dim = Chaser::point_dim;
  using States = std::tuple<Chaser, Target>;

  Vector<Chaser::point_dim> z;  ///< m, in the sensor's frame
  Chaser B{};                   ///< sensor in the chaser's body
  /// t(F) [m], in the target's body; zero when the target is a point
  Vector<Chaser::point_dim> beacon = Vector<Chaser::point_dim>::Zero();

  template <Over<Chaser> C, Over<Target> T>
  void operator()(const C& c, const T& t, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, T>* Jt = nullptr) const {
    using S = typename C::Scalar;
    const Vector<dim, S> f = beacon.template cast<S>();
    const C to_body = c.inverse();
    const Vector<dim, S> in_body = to_body.act(t.act(f));
    const C to_sensor = B.inverse().template cast<S>();
    r = to_sensor.act(in_body) - z.template cast<S>();
    if (Jc) Jc->noalias() = -to_sensor.rotation().matrix() * C::identity().act_jacobian(in_body);
    if (Jt) Jt->noalias() = (to_sensor.rotation() * to_body.rotation()).matrix() * t.act_jacobian(f);
  }
};

}  // namespace tandem
