#pragma once

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual_functions.hpp>
#include <tandem/residuals/sensor_frame_curvature.hpp>

namespace tandem {

/// Target position in the frame of a sensor on the chaser [m]:  e = t((C B)⁻¹ (T F)) − z. The target T is a pose or a
/// point (SE3, SE2, R3, R2). Only the position of F (the beacon) matters. Source: Baxter & Teran Espinoza 2025, §V-A,
/// eqs. 9-14 (USBL).
template <LieGroup Chaser = SE3, LieGroup Target = Chaser>
requires(Chaser::point_dim == Target::point_dim) struct UsblPosition {
  static constexpr std::string_view name = "USBL position";
  static constexpr int dim = Chaser::point_dim;
  using States = std::tuple<Chaser, Target>;

  Vector<Chaser::point_dim> z;  ///< m, in the sensor's frame
  Chaser B{};                   ///< sensor in the chaser's body
  /// t(F) [m], in the target's body; zero if the target is a point
  Vector<Chaser::point_dim> beacon = Vector<Chaser::point_dim>::Zero();

  auto fields() { return std::tie(z, B, beacon); }

  template <Over<Chaser> C, Over<Target> T>
  void operator()(const C& c, const T& t, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, T>* Jt = nullptr) const {
    r = in_sensor_frame(c, t, B, beacon, Jc, Jt) - z.template cast<typename C::Scalar>();
  }

  void curvature(const Chaser& c, const Target& t, const Vector<dim>& w,
                 Matrix<Chaser::dof + Target::dof, Chaser::dof + Target::dof>& H)
      const requires detail::HasSightCurvature<Chaser, Target> {
    detail::curvature_in_sensor_frame(c, t, B, beacon, w, H);
  }
};

// Instantiated in usbl_position.cpp.
namespace detail {
extern template struct FunctionsOf<UsblPosition<SE3, SE3>>;
extern template struct FunctionsOf<UsblPosition<SE3, R3>>;
}  // namespace detail

}  // namespace tandem
