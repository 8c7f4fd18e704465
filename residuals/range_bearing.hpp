#pragma once

#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/direction.hpp>
#include <tandem/residuals/sensor_frame.hpp>

namespace tandem {

/// Distance and direction from a sensor on the chaser to the target [m, rad]: the row of Range above those of Bearing,
/// with p = t((C B)⁻¹ (T F)). The target T is a pose or a point (SE3, SE2, R3, R2). Throws UndefinedResidualError where
/// the residual is undefined: with the target at the sensor, and in space opposite to the measured direction.
template <LieGroup Chaser = SE3, LieGroup Target = Chaser>
requires(Chaser::point_dim == Target::point_dim &&
         (Chaser::point_dim == 2 || Chaser::point_dim == 3)) struct RangeBearing {
  static constexpr std::string_view name = "range-bearing";
  static constexpr int dim = Chaser::point_dim;
  using States = std::tuple<Chaser, Target>;

  double range;                          ///< m
  Direction<Chaser::point_dim> bearing;  ///< in the sensor's frame
  Chaser B{};                            ///< sensor in the chaser's body
  /// t(F) [m], in the target's body; zero if the target is a point
  Vector<Chaser::point_dim> beacon = Vector<Chaser::point_dim>::Zero();

  auto fields() { return std::tie(range, bearing, B, beacon); }

  template <Over<Chaser> C, Over<Target> T>
  void operator()(const C& c, const T& t, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, T>* Jt = nullptr) const {
    using S = typename C::Scalar;
    const auto measure = [&](const Vector<dim, S>& p, Matrix<dim, dim, S>* by_p) {
      check_not_at_sensor(p, name);
      const S distance = p.norm();
      Matrix<dim - 1, dim, S> direction_by_p;
      Rows<dim, C> e;
      e << distance - range, bearing.log(p, by_p ? &direction_by_p : nullptr);
      if (by_p) *by_p << p.transpose() / distance, direction_by_p;
      return e;
    };
    observe<dim>(c, t, B, beacon, measure, r, Jc, Jt);
  }
};

}  // namespace tandem
