#pragma once

#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/direction.hpp>
#include <tandem/residuals/sensor_frame.hpp>

namespace tandem {

/// Direction from a sensor on the chaser to the target [rad], p = t((C B)⁻¹ (T F)). In space: Log on S² of the
/// direction of p at the measured one, along increasing azimuth and elevation. In the plane: the angle from the
/// measured direction, in (−π, π]. The target T is a pose or a point (SE3, SE2, R3, R2). Throws UndefinedResidualError
/// where the residual is undefined: with the target at the sensor, and in space opposite to the measured direction.
template <LieGroup Chaser = SE3, LieGroup Target = Chaser>
requires(Chaser::point_dim == Target::point_dim && (Chaser::point_dim == 2 || Chaser::point_dim == 3)) struct Bearing {
  static constexpr std::string_view name = "bearing";
  static constexpr int dim = Chaser::point_dim - 1;
  using States = std::tuple<Chaser, Target>;

  Direction<Chaser::point_dim> bearing;  ///< in the sensor's frame
  Chaser B{};                            ///< sensor in the chaser's body
  /// t(F) [m], in the target's body; zero if the target is a point
  Vector<Chaser::point_dim> beacon = Vector<Chaser::point_dim>::Zero();

  auto fields() { return std::tie(bearing, B, beacon); }

  template <Over<Chaser> C, Over<Target> T>
  void operator()(const C& c, const T& t, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, T>* Jt = nullptr) const {
    using S = typename C::Scalar;
    constexpr int n = Chaser::point_dim;
    const auto measure = [&](const Vector<n, S>& p, Matrix<dim, n, S>* by_p) {
      check_not_at_sensor(p, name);
      return bearing.log(p, by_p);
    };
    observe<dim>(c, t, B, beacon, measure, r, Jc, Jt);
  }
};

}  // namespace tandem
