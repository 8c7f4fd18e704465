#pragma once

#include <numbers>

#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/mahalanobis.hpp>

namespace tandem {

/// Returns the NEES of a relative position, without z in the plane; nothing without a covariance or if it is singular.
inline std::optional<double> relative_nees(const std::optional<Vector<3>>& error,
                                           const std::optional<Matrix<3, 3>>& covariance) {
  if (!error || !covariance) return {};
  const int n = (*covariance)(2, 2) == 0 ? 2 : 3;
  return normalized_squared_error(error->head(n), covariance->topLeftCorner(n, n));
}

/// Adds the columns of the relative pose in errors.csv, which `estimate` and `track` share. A row has the members
/// `error` (KeyframeError), `frame` (Frame), `three_sigma` (std::optional<Vector<3>>, along the chaser's axes [m]) and
/// `nees` (std::optional<double>).
template <class Row>
void add_relative_error_columns(CsvTable<Row>& table) {
  const auto in_body = [](const Frame& frame, std::optional<Vector<3>> v, double unit) {
    if (v) v = frame.body(Vector<3>(unit * *v));
    return v;
  };
  table.add("t", "time of the keyframe [s]", [](const Row& r) { return r.error.t; })
      .add("type", kKeyframeTypeColumn, [](const Row& r) { return name(r.error.type); })
      .add("position_error_m", "error of the target's position relative to the chaser, magnitude [m]",
           [](const Row& r) { return r.error.position; })
      .add("orientation_error_deg", "error of the target's orientation relative to the chaser, rotation angle [deg]",
           [](const Row& r) { return r.error.orientation; })
      .add_xyz("error_{}_m", "error of the relative position, estimate minus truth, along the chaser's axes [m]",
               [=](const Row& r) { return in_body(r.frame, r.error.position_vector, 1); })
      .add_xyz("error_r{}_deg", "error of the relative orientation, a rotation vector about the target's axes [deg]",
               [=](const Row& r) { return in_body(r.frame, r.error.rotation_vector, 180.0 / std::numbers::pi); })
      .add_xyz("three_sigma_{}_m", "3σ bound of the relative position along the chaser's axes [m]",
               [](const Row& r) { return r.three_sigma; })
      .add("position_nees",
           "normalised estimation error squared (NEES) of the relative position: 3 on average if "
           "consistent, 2 in the plane; empty where the covariance is singular",
           [](const Row& r) { return r.nees; });
}

}  // namespace tandem
