#pragma once

#include <tandem/lie/sek3.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Adds the columns x, y, z, qx, qy, qz, qw. A row has the members position (Vector<3>, perhaps optional) and
/// orientation (std::optional<SO3>).
template <class Row>
void add_position_columns(CsvTable<Row>& table) {
  table.add_xyz("{}", "position along the world axes [m]", [](const Row& r) { return r.position; });
  table.add_each({"x", "y", "z", "w"}, "q{}", "orientation, a Hamilton quaternion; empty for points",
                 [](const Row& r) -> std::optional<Vector<4>> {
                   if (!r.orientation) return {};
                   return Vector<4>(r.orientation->quaternion().coeffs());
                 });
}

/// Adds the column t [s] of a keyframe, and the columns of add_position_columns().
template <class Row>
void add_pose_columns(CsvTable<Row>& table) {
  table.add("t", "time of the keyframe [s]", [](const Row& r) { return r.t; });
  add_position_columns(table);
}

/// Returns the entry (i, j); an empty cell outside the matrix.
inline CsvCell entry_cell(const Eigen::MatrixXd& m, Eigen::Index i, Eigen::Index j) {
  return i < m.rows() && j < m.cols() ? CsvCell(m(i, j)) : CsvCell();
}

/// Adds the columns c11 … c66. A row has a member `covariance`, a 6 × 6, 3 × 3 or empty matrix.
template <class Row>
void add_covariance_columns(CsvTable<Row>& table) {
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = 0; j < 6; ++j)
      table.add(
          "c" + std::to_string(i + 1) + std::to_string(j + 1),
          "covariance, row by row, of right perturbations: x y z [m], then rotation [rad], along the body axes; for a "
          "point the upper left 3 × 3 block, along the world axes",
          [i, j](const Row& r) { return entry_cell(r.covariance, i, j); });
}

}  // namespace tandem
