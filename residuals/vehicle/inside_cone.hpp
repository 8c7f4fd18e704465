#pragma once

#include <cmath>

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/sensor_frame_curvature.hpp>

namespace tandem {

/// Distance of a point to the surface of a cone, positive inside [m]. The axis of the cone is x of the frame C B, and p
/// = t((C B)⁻¹ (T F)):
///
///   e = p_x sin α − (√(p_y² + p_z² + ε²) − ε) cos α
///
/// The distance is exact except for ε = 1 cm, which makes it smooth on the axis. The constraint e ≥ 0 models the field
/// of view of a camera: C is the chaser with the camera at B, T the target with its lights at `beacon`. It also models
/// an approach corridor: C is the target with the dock at B, T the chaser. T is a pose or a point.
template <LieGroup Target = SE3>
requires(Target::point_dim == 3) struct InsideCone {
  static constexpr std::string_view name = "inside cone";
  static constexpr int dim = 1;
  static constexpr double kRounding = 0.01;  ///< m
  using States = std::tuple<SE3, Target>;

  double half_angle;                     ///< α [rad], in (0, π/2)
  SE3 B{};                               ///< apex and axis on the body C
  Vector<3> beacon = Vector<3>::Zero();  ///< t(F) [m], in the body T; zero if T is a point

  auto fields() { return std::tie(half_angle, B, beacon); }

  template <Over<SE3> C, Over<Target> T>
  void operator()(const C& c, const T& t, Rows<1, C>& r, RowsBy<1, C>* Jc = nullptr, RowsBy<1, T>* Jt = nullptr) const {
    using S = typename C::Scalar;
    using std::sqrt;
    const double sine = std::sin(half_angle), cosine = std::cos(half_angle);
    const auto measure = [&](const Vector<3, S>& p, Matrix<1, 3, S>* by_p) {
      const S off_axis = sqrt(p[1] * p[1] + p[2] * p[2] + S(kRounding * kRounding));
      if (by_p) *by_p << S(sine), S(-cosine) * p[1] / off_axis, S(-cosine) * p[2] / off_axis;
      return Rows<1, C>(sine * p[0] - cosine * (off_axis - kRounding));
    };
    observe<1>(c, t, B, beacon, measure, r, Jc, Jt);
  }

  void curvature(
      const SE3& c, const Target& t, const Vector<dim>& w,
      Matrix<SE3::dof + Target::dof, SE3::dof + Target::dof>& H) const requires detail::HasSightCurvature<SE3, Target> {
    const Vector<3> p = in_sensor_frame(c, t, B, beacon), q(0.0, p[1], p[2]);
    const double off_axis = std::sqrt(p[1] * p[1] + p[2] * p[2] + kRounding * kRounding);
    const double along = w[0] * std::sin(half_angle), across = -w[0] * std::cos(half_angle) / off_axis;
    const Vector<3> by_p = across * q + along * Vector<3>::UnitX();
    const Matrix<3, 3> of_p =
        across * (Matrix<3, 3>(Vector<3>(0, 1, 1).asDiagonal()) - q * q.transpose() / (off_axis * off_axis));
    detail::curvature_of_observed(c, t, B, beacon, by_p, of_p, H);
  }
};

}  // namespace tandem
