#pragma once

#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/sensor_frame.hpp>

namespace tandem {

/// USBL fix in spherical coordinates [m, rad], p = t((C B)⁻¹ (T F)):
///
///   e = [‖p‖ − range;  atan2(p_y, p_x) − azimuth, in (−π, π];  atan2(p_z, h) − elevation],  h = √(p_x² + p_y²)
///
/// The azimuth row is an angle about the sensor's z axis, not an arc; near that axis RangeBearing is better
/// conditioned. The target T is a pose or a point (SE3, R3). Throws UndefinedResidualError where the residual is
/// undefined: with the target at the sensor or within 1e-8 rad of the z axis.
template <LieGroup Chaser = SE3, LieGroup Target = Chaser>
requires(Chaser::point_dim == 3 && Target::point_dim == 3) struct UsblSpherical {
  static constexpr std::string_view name = "USBL in spherical coordinates";
  static constexpr int dim = 3;
  using States = std::tuple<Chaser, Target>;

  double range;                          ///< m
  double azimuth;                        ///< rad, from the sensor's x axis towards y.
  double elevation;                      ///< rad, from the sensor's xy-plane towards z.
  Chaser B{};                            ///< Sensor in the chaser's body.
  Vector<3> beacon = Vector<3>::Zero();  ///< t(F) [m], in the target's body; zero if the target is a point.

  auto fields() { return std::tie(range, azimuth, elevation, B, beacon); }

  template <Over<Chaser> C, Over<Target> T>
  void operator()(const C& c, const T& t, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, T>* Jt = nullptr) const {
    using S = typename C::Scalar;
    const auto measure = [&](const Vector<3, S>& p, Matrix<3, 3, S>* by_p) {
      using std::atan2, std::sqrt;
      check_not_at_sensor(p, name);
      const S distance = p.norm();
      const S h2 = p[0] * p[0] + p[1] * p[1], distance2 = distance * distance;
      if (h2 < 1e-16 * distance2)
        throw UndefinedResidualError(std::string(name) +
                                     ": azimuth is undefined on the z axis of the sensor; use range-bearing instead");
      const S h = sqrt(h2);
      if (by_p) {
        const S k = -p[2] / (h * distance2);
        *by_p << p[0] / distance, p[1] / distance, p[2] / distance,  //
            -p[1] / h2, p[0] / h2, S(0.),                            //
            k * p[0], k * p[1], h / distance2;
      }
      const double ca = std::cos(azimuth), sa = std::sin(azimuth);
      return Vector<3, S>(distance - range, atan2(ca * p[1] - sa * p[0], ca * p[0] + sa * p[1]),
                          atan2(p[2], h) - elevation);
    };
    observe<dim>(c, t, B, beacon, measure, r, Jc, Jt);
  }
};

}  // namespace tandem
