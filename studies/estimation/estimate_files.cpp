#include <algorithm>
#include <cmath>
#include <functional>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/solvers/relative_covariance.hpp>
#include <tandem/studies/estimation/error_columns.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/fit/fit_files.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/state_columns.hpp>
#include <tandem/studies/support/tum.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

using OptionalVector = std::optional<Vector<3>>;

/// The chaser or the target, as functions of the keyframe.
struct Body {
  std::function<TargetState(std::size_t)> state;
  std::function<Eigen::MatrixXd(std::size_t)> covariance;
  const std::vector<Vector<6>>& twist;  ///< if empty, twists come from consecutive poses
  const std::vector<Stamped<SE3>>& truth;
};

/// The chaser or the target at a keyframe, in the scenario's frame.
struct StateRow {
  double t;
  Vector<3> position;
  std::optional<SO3> orientation;
  OptionalVector velocity, angular_velocity;  ///< along the body axes
  Eigen::MatrixXd covariance;                 ///< may be empty
};

/// Returns the model's body twist or, without it, the mean twist between the neighbouring keyframes. The mean is
/// one-sided at the ends and beside points; nothing is returned without a neighbouring pose.
std::optional<Vector<6>> twist_at(const Estimate& estimate, const Body& body, std::size_t k) {
  if (!body.twist.empty()) return body.twist[k];
  const auto pose = [&](std::size_t i) -> std::optional<SE3> {
    if (i >= estimate.keyframes.size()) return {};
    const TargetState x = body.state(i);
    if (!x.rotation) return {};
    return SE3(*x.rotation, x.position);
  };
  if (!pose(k)) return {};
  const std::size_t from = k > 0 && pose(k - 1) ? k - 1 : k, to = pose(k + 1) ? k + 1 : k;
  if (from == to) return {};
  return Vector<6>(minus(*pose(to), *pose(from)) / (estimate.keyframes[to].t - estimate.keyframes[from].t));
}

/// Transforms the covariance of a pose (6 × 6) or a point (3 × 3) to the scenario's axes.
Eigen::MatrixXd in_frame(const Frame& frame, const Eigen::MatrixXd& covariance) {
  if (covariance.size() == 0) return covariance;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(covariance.rows(), covariance.rows());
  A.topLeftCorner<3, 3>() = covariance.rows() == 3 ? frame.world_axes() : frame.body_axes();
  if (covariance.rows() == 6) A.bottomRightCorner<3, 3>() = frame.body_axes();
  return detail::propagated(A, covariance);
}

StateRow state_row(const Estimate& estimate, const Body& body, std::size_t k) {
  const Frame& frame = estimate.frame;
  const TargetState x = body.state(k);
  const SE3 pose = frame.world(SE3(x.rotation.value_or(SO3()), x.position));
  StateRow row{estimate.keyframes[k].t, pose.translation(), {}, {}, {}, {}};
  if (x.rotation) row.orientation = pose.rotation();
  if (const auto twist = twist_at(estimate, body, k)) {
    row.velocity = frame.body(Vector<3>(twist->head<3>()));
    row.angular_velocity = frame.body(Vector<3>(twist->tail<3>()));
  }
  if (!estimate.uncertainty.empty()) row.covariance = in_frame(frame, body.covariance(k));
  return row;
}

CsvTable<StateRow> state_columns() {
  CsvTable<StateRow> table;
  add_pose_columns(table);
  table.add_xyz("v{}",
                "velocity along the body axes [m/s]: a state of the model, or else the mean between the neighbouring "
                "keyframes",
                [](const StateRow& r) { return r.velocity; });
  table.add_xyz("w{}", "angular velocity about the body axes [rad/s], from the same source as v",
                [](const StateRow& r) { return r.angular_velocity; });
  add_covariance_columns(table);
  return table;
}

/// The covariance of the chaser with the target at a keyframe.
struct CrossRow {
  double t;
  Eigen::MatrixXd covariance;  // in the scenario's frame
};

CsvTable<CrossRow> cross_columns() {
  CsvTable<CrossRow> table;
  table.add("t", "time of the keyframe [s]", [](const CrossRow& r) { return r.t; });
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = 0; j < 6; ++j)
      table.add(
          "c" + std::to_string(i + 1) + std::to_string(j + 1),
          "covariance of row i of the chaser with row j of the target, as in their files; three columns for a point",
          [i, j](const CrossRow& r) { return entry_cell(r.covariance, i, j); });
  return table;
}

std::string cross_text(const Estimate& estimate) {
  const CsvTable<CrossRow> table = cross_columns();
  std::string text = table.header();
  const auto axes = [&](Eigen::Index n) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
    A.topLeftCorner<3, 3>() = n == 3 ? estimate.frame.world_axes() : estimate.frame.body_axes();
    if (n == 6) A.bottomRightCorner<3, 3>() = estimate.frame.body_axes();
    return A;
  };
  for (std::size_t k = 0; k < estimate.uncertainty.size(); ++k) {
    const Eigen::MatrixXd& cross = estimate.uncertainty[k].cross;
    if (cross.size() == 0) continue;
    text += table.row({estimate.keyframes[k].t, axes(6) * cross * axes(cross.cols()).transpose()});
  }
  return text;
}

/// A down-weighted measurement.
struct WeightRow {
  std::string sensor;
  double t;
  PartWeight part;
};

CsvTable<WeightRow> weight_columns() {
  return CsvTable<WeightRow>()
      .add("sensor", "name of the sensor", [](const WeightRow& r) { return r.sensor; })
      .add("t", "stamp of the measurement [s]", [](const WeightRow& r) { return r.t; })
      .add("part", "all, or position or orientation if these have separate losses",
           [](const WeightRow& r) { return r.part.part; })
      .add("weight", "weight that the robust loss gives the measurement, below 0.5",
           [](const WeightRow& r) { return r.part.weight; });
}

std::vector<WeightRow> weight_rows(const Estimate& estimate) {
  std::vector<WeightRow> rows;
  for (const MeasurementOutcome& m : estimate.measurements)
    for (const PartWeight& part : m.parts)
      if (part.weight < kDownweightThreshold) rows.push_back({estimate.sensors[m.sensor].name, m.t, part});
  return rows;
}

struct HeldOutRow {
  std::string sensor;
  const Validation& validation;
};

/// `rows` is the largest number of rows of any residual.
CsvTable<HeldOutRow> held_out_columns(Eigen::Index rows) {
  std::vector<std::string> numbers;
  for (Eigen::Index i = 1; i <= rows; ++i) numbers.push_back(std::to_string(i));
  return CsvTable<HeldOutRow>()
      .add("sensor", "name of the sensor", [](const HeldOutRow& r) { return r.sensor; })
      .add("t", "stamp of the measurement [s]", [](const HeldOutRow& r) { return r.validation.t; })
      .add("inlier", "1: its weight is 0.5 or more in an estimate with all measurements, else 0; empty if unknown",
           [](const HeldOutRow& r) { return r.validation.inlier; })
      .add("rows", "number of rows of the residual",
           [](const HeldOutRow& r) { return r.validation.prediction.r.size(); })
      .add("rows_inside", "number of rows within their 95 % interval",
           [](const HeldOutRow& r) { return r.validation.prediction.rows_inside(); })
      .add("squared_distance", "normalised squared residual: χ² with one degree of freedom per row",
           [](const HeldOutRow& r) { return r.validation.prediction.squared_distance(); })
      .add_each(numbers, "residual_{}", "measurement minus prediction, in the sensor's units",
                [](const HeldOutRow& r) { return r.validation.prediction.r; })
      .add_each(numbers, "sigma_{}", "standard deviation of the residual: prediction and measurement noise combined",
                [](const HeldOutRow& r) {
                  return Eigen::VectorXd(r.validation.prediction.covariance.diagonal().cwiseSqrt());
                });
}

std::vector<HeldOutRow> held_out_rows(const Estimate& estimate) {
  std::vector<HeldOutRow> rows;
  for (const Validation& v : estimate.held_out) rows.push_back({estimate.sensors[v.prediction.sensor].name, v});
  return rows;
}

/// A measured position of the target in the world.
struct FixRow {
  double t;
  std::string sensor;
  KeyframeType type;
  Vector<3> position;
};

CsvTable<FixRow> fix_columns() {
  return CsvTable<FixRow>()
      .add("t", "time of the keyframe [s]", [](const FixRow& r) { return r.t; })
      .add("sensor", "name of the sensor", [](const FixRow& r) { return r.sensor; })
      .add("type", "measurement of the sensor: position or pose", [](const FixRow& r) { return name(r.type); })
      .add_xyz("{}_m", "measured position of the target, relative to the estimated chaser, along the world axes [m]",
               [](const FixRow& r) { return r.position; });
}

/// Returns the measured positions and poses at the keyframes, in time order; held-out measurements do not count.
std::vector<FixRow> fix_rows(const Estimate& estimate, const Scenario& scenario) {
  std::vector<FixRow> rows;
  for (const TargetSensor& sensor : scenario.data.sensors)
    for (const Measurement& m : sensor.measurements) {
      const auto position = sensor.position_in_chaser(m);
      const auto k = keyframe_at(estimate.keyframes, sensor.valid_at(m));
      if (!position || !k || m.held_out) continue;
      const bool pose = sensor.type->has(measured::rotation);
      rows.push_back({estimate.keyframes[*k].t, sensor.name, pose ? KeyframeType::pose : KeyframeType::position,
                      estimate.frame.world(estimate.chaser[*k].act(*position))});
    }
  std::stable_sort(rows.begin(), rows.end(), [](const FixRow& a, const FixRow& b) { return a.t < b.t; });
  return rows;
}

/// Errors and bounds at a keyframe.
struct ErrorRow {
  const KeyframeError& error;
  const Frame& frame;
  OptionalVector three_sigma, three_sigma_rotation;
  std::optional<double> nees;
};

CsvTable<ErrorRow> error_columns() {
  CsvTable<ErrorRow> table;
  add_relative_error_columns(table);
  return table.add_xyz("three_sigma_r{}_deg", "3σ bound of the relative orientation about the target's axes [deg]",
                       [](const ErrorRow& r) { return r.three_sigma_rotation; });
}

std::vector<ErrorRow> csv_error_rows(const Estimate& estimate) {
  std::vector<ErrorRow> rows;
  for (std::size_t k = 0; k < estimate.errors.size(); ++k) {
    ErrorRow& row = rows.emplace_back(ErrorRow{estimate.errors[k], estimate.frame, {}, {}, {}});
    if (estimate.uncertainty.empty()) continue;
    row.three_sigma = 3 * estimate.uncertainty[k].position_sigma();
    row.nees = relative_nees(estimate.errors[k].position_vector, estimate.uncertainty[k].relative_position);
    row.three_sigma_rotation = estimate.uncertainty[k].rotation_sigma();
    if (row.three_sigma_rotation) *row.three_sigma_rotation *= 3 * kDegrees;
  }
  return rows;
}

/// Returns the true poses at the keyframes that the truth covers; an empty text if it covers none.
std::string truth_tum(const Estimate& estimate, const Scenario& scenario, const Body& body) {
  std::string text;
  for (const Keyframe& keyframe : estimate.keyframes)
    if (const auto pose = pose_at(body.truth, keyframe.t)) {
      const SE3 truth = estimate.frame.world(*pose);
      text += tum_row(keyframe.t, truth.translation(),
                      scenario.truth_orientation ? std::optional(truth.rotation()) : std::nullopt);
    }
  return text.empty() ? text : tum_header + text;
}

void write_body(const Estimate& estimate, const Scenario& scenario, const Body& body,
                const std::filesystem::path& folder, const std::string& who) {
  const CsvTable<StateRow> table = state_columns();
  std::string tum = tum_header, csv = table.header();
  for (std::size_t k = 0; k < estimate.keyframes.size(); ++k) {
    const StateRow row = state_row(estimate, body, k);
    tum += tum_row(row.t, row.position, row.orientation);
    csv += table.row(row);
  }
  write_file(folder / (who + ".tum"), tum);
  write_file(folder / (who + "_full.csv"), csv);
  if (const std::string truth = truth_tum(estimate, scenario, body); !truth.empty())
    write_file(folder / (who + "_truth.tum"), truth);
}

}  // namespace

void write_results(const Estimate& estimate, const Scenario& scenario, const std::filesystem::path& folder) {
  const std::vector<Vector<6>> from_poses;
  const Body chaser{[&](std::size_t k) { return TargetState(estimate.chaser[k]); },
                    [&](std::size_t k) { return estimate.uncertainty[k].chaser; }, from_poses, scenario.truth_chaser};
  const Body target{[&](std::size_t k) { return estimate.target[k]; },
                    [&](std::size_t k) { return estimate.uncertainty[k].target; }, estimate.target_twist,
                    scenario.truth_target};
  write_body(estimate, scenario, chaser, folder, "chaser");
  write_body(estimate, scenario, target, folder, "target");
  if (!estimate.uncertainty.empty()) write_file(folder / "cross_covariance.csv", cross_text(estimate));
  write_file(folder / "errors.csv", error_columns().text(csv_error_rows(estimate)));
  write_file(folder / "target_fixes.csv", fix_columns().text(fix_rows(estimate, scenario)));
  write_file(folder / "weights.csv", weight_columns().text(weight_rows(estimate)));
  write_fit(estimate.fit, folder);
  if (!estimate.at.empty()) write_states_at(estimate.at, estimate.frame, true, folder);
  if (!estimate.held_out.empty()) {
    Eigen::Index rows = 0;
    for (const Validation& v : estimate.held_out) rows = std::max(rows, v.prediction.r.size());
    write_file(folder / "held_out.csv", held_out_columns(rows).text(held_out_rows(estimate)));
  }
  write_file(folder / "summary.json", summary_json(estimate));
}

std::vector<FileDescription> estimate_file_columns() {
  return {state_columns().describe("chaser_full.csv, target_full.csv"),
          error_columns().describe("errors.csv"),
          cross_columns().describe("cross_covariance.csv"),
          fix_columns().describe("target_fixes.csv"),
          weight_columns().describe("weights.csv"),
          fit_file_columns(),
          held_out_columns(6).describe("held_out.csv"),
          states_at_columns(true)};
}

}  // namespace tandem
