#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Coincidence of a pose and a point at the same instant [m]:  e = t(X) − x. Connects the two where a trajectory
/// changes from poses to points or back. Source: Baxter & Teran Espinoza 2025, §V-A, eqs. 9-14 (boundary factor).
template <LieGroup Pose = SE3>
requires requires(const Pose& x) { x.translation(); }
struct Boundary {
  static constexpr std::string_view name = "boundary";
  static constexpr int dim = Pose::point_dim;
  using States = std::tuple<Pose, Rn<Pose::point_dim>>;

  auto fields() { return std::tie(); }

  template <Over<Pose> X, Over<Rn<Pose::point_dim>> Point>
  void operator()(const X& pose, const Point& point, Rows<dim, X>& r, RowsBy<dim, X>* J_pose = nullptr,
                  RowsBy<dim, Point>* J_point = nullptr) const {
    r = pose.translation() - point.vector();
    if (J_pose) *J_pose = pose.act_jacobian(Rows<dim, X>::Zero());
    if (J_point) *J_point = -RowsBy<dim, Point>::Identity();
  }
};

}  // namespace tandem
