#pragma once

#include <cmath>
#include <tuple>

#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/sensor_frame.hpp>

namespace tandem {

/// Logarithm of the distance from a sensor on the chaser to the target:  e = log(‖p‖ / range),  p = t((C B)⁻¹ (T F)).
/// It is a prior for a distance of unknown size. A standard deviation of 1 means a factor e. The residual grows without
/// bound as the target approaches the sensor. The target T is a pose or a point (SE3, SE2, R3, R2). Throws Error if
/// the target is at the sensor, because the residual is undefined there.
template <LieGroup Chaser = SE3, LieGroup Target = Chaser>
requires(Chaser::point_dim == Target::point_dim) struct LogRange {
  static constexpr std::string_view name = "logarithmic range";
  static constexpr int dim = 1;
  using States = std::tuple<Chaser, Target>;

  double range;  ///< m
  Chaser B{};    ///< sensor in the chaser's body
  /// t(F) [m], in the target's body; zero if the target is a point
  Vector<Chaser::point_dim> beacon = Vector<Chaser::point_dim>::Zero();

  auto fields() { return std::tie(range, B, beacon); }

  template <Over<Chaser> C, Over<Target> T>
  void operator()(const C& c, const T& t, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, T>* Jt = nullptr) const {
    using S = typename C::Scalar;
    constexpr int n = Chaser::point_dim;
    const auto measure = [&](const Vector<n, S>& p, Matrix<dim, n, S>* by_p) {
      using std::log;
      check_not_at_sensor(p, name);
      if (by_p) *by_p = p.transpose() / p.squaredNorm();
      return Rows<dim, C>(log(S(p.norm() / range)));
    };
    observe<dim>(c, t, B, beacon, measure, r, Jc, Jt);
  }
};

}  // namespace tandem
