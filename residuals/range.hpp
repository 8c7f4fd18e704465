#pragma once

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/sensor_frame_curvature.hpp>

namespace tandem {

/// Distance from a sensor on the chaser to the target [m]:  e = ‖p‖ − range,  p = t((C B)⁻¹ (T F)). The target T is a
/// pose or a point (SE3, SE2, R3, R2). Throws UndefinedResidualError with the target at the sensor, where the residual
/// is undefined.
template <LieGroup Chaser = SE3, LieGroup Target = Chaser>
requires(Chaser::point_dim == Target::point_dim) struct Range {
  static constexpr std::string_view name = "range";
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
      check_not_at_sensor(p, name);
      const S distance = p.norm();
      if (by_p) *by_p = p.transpose() / distance;
      return Rows<dim, C>(distance - range);
    };
    observe<dim>(c, t, B, beacon, measure, r, Jc, Jt);
  }

  void curvature(const Chaser& c, const Target& t, const Vector<dim>& w,
                 Matrix<Chaser::dof + Target::dof, Chaser::dof + Target::dof>& H)
      const requires detail::HasSightCurvature<Chaser, Target> {
    const Vector<3> p = in_sensor_frame(c, t, B, beacon);
    check_not_at_sensor(p, name);
    const double distance = p.norm(), scale = w[0] / distance;
    const Matrix<3, 3> of_p = scale * (Matrix<3, 3>::Identity() - p * p.transpose() / (distance * distance));
    detail::curvature_of_observed(c, t, B, beacon, Vector<3>(scale * p), of_p, H);
  }
};

}  // namespace tandem
