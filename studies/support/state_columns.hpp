#pragma once

#include <tandem/lie/sek3.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Adds t, x, y, z and qx, qy, qz, qw. A row has members t [s], position (Vector<3>) and orientation (std::optional<SO3>).
template <class Row>
void add_pose_columns(CsvTable<Row>& table) {
  table.add("t", "time of the keyframe [s]", [](const Row& r) { return r.t; });
  table.add_xyz("{}", "position along the world's axes [m]", [](const Row& r) { return Vector<3>(r.position); });
  table.add_each({"x", "y", "z", "w"}, "q{}", "orientation, a Hamilton quaternion; empty where there is none",
                 [](const Row& r) -> std::optional<Vector<4>> {
                   if (!r.orientation) return {};
                   return Vector<4>(r.orientation->quaternion().coeffs());
                 });
}

/// Adds c11 … c66, row by row. A row has a member `covariance`, a matrix of 6 × 6, 3 × 3 or nothing.
template <class Row>
void add_covariance_columns(CsvTable<Row>& table) {
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = 0; j < 6; ++j)
      table.add(
          "c" + std::to_string(i + 1) + std::to_string(j + 1),
          "covariance, row by row, of right perturbations: x y z [m], then rotation [rad], body axes; of a point its "
          "upper left 3 × 3, along the world's axes",
          [i, j](const Row& r) {
            return i < r.covariance.rows() && j < r.covariance.cols() ? CsvCell(r.covariance(i, j)) : CsvCell();
          });
}

}  // namespace tandem
