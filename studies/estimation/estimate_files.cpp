#include <cmath>
#include <functional>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/studies/estimation/error_columns.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/state_columns.hpp>
#include <tandem/studies/support/tum.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

using OptionalVector = std::optional<Vector<3>>;

/// What is written of chaser or target; everything by keyframe.
struct Body {
  std::function<TargetState(std::size_t)> state;
  std::function<Eigen::MatrixXd(std::size_t)> covariance;
  const std::vector<Vector<6>>& twist;  ///< empty: from the poses
  const std::vector<Stamped<SE3>>& truth;
};

/// Chaser or target at a keyframe, in the scenario's frame.
struct StateRow {
  double t;
  Vector<3> position;
  std::optional<SO3> orientation;
  OptionalVector velocity, angular_velocity;  ///< body axes
  Eigen::MatrixXd covariance;                 ///< may be nothing
};

/// The mean body twist over the neighbouring keyframes, one-sided at the ends and beside points.
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

/// A covariance of a pose, or of a point, with the scenario's axes.
Eigen::MatrixXd in_frame(const Frame& frame, const Eigen::MatrixXd& covariance) {
  if (covariance.size() == 0) return covariance;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(covariance.rows(), covariance.rows());
  A.topLeftCorner<3, 3>() = covariance.rows() == 3 ? frame.world_axes() : frame.body_axes();
  if (covariance.rows() == 6) A.bottomRightCorner<3, 3>() = frame.body_axes();
  return A * covariance * A.transpose();
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
                "velocity along the body's axes [m/s]: mean between the neighbouring keyframes, or the model's own",
                [](const StateRow& r) { return r.velocity; });
  table.add_xyz("w{}", "angular velocity about the body's axes [rad/s], likewise",
                [](const StateRow& r) { return r.angular_velocity; });
  add_covariance_columns(table);
  return table;
}

/// A measurement that a robust loss left little of.
struct WeightRow {
  std::string sensor;
  double t;
  PartWeight part;
};

CsvTable<WeightRow> weight_columns() {
  return CsvTable<WeightRow>()
      .add("sensor", "its name", [](const WeightRow& r) { return r.sensor; })
      .add("t", "as stamped [s]", [](const WeightRow& r) { return r.t; })
      .add("part", "all, or position or orientation where these have losses of their own",
           [](const WeightRow& r) { return r.part.part; })
      .add("weight", "what the loss leaves of it, below 0.5", [](const WeightRow& r) { return r.part.weight; });
}

std::vector<WeightRow> weight_rows(const Estimate& estimate) {
  std::vector<WeightRow> rows;
  for (const MeasurementOutcome& m : estimate.measurements)
    for (const PartWeight& part : m.parts)
      if (part.weight < kDownWeighted) rows.push_back({estimate.sensors[m.sensor].name, m.t, part});
  return rows;
}

struct HeldOutRow {
  std::string sensor;
  const Validation& validation;
};

/// `rows`: of the residual that has most.
CsvTable<HeldOutRow> held_out_columns(Eigen::Index rows) {
  std::vector<std::string> numbers;
  for (Eigen::Index i = 1; i <= rows; ++i) numbers.push_back(std::to_string(i));
  return CsvTable<HeldOutRow>()
      .add("sensor", "its name", [](const HeldOutRow& r) { return r.sensor; })
      .add("t", "as stamped [s]", [](const HeldOutRow& r) { return r.validation.t; })
      .add("inlier", "1 or 0: whether the robust losses keep it in the same estimate with all measurements in",
           [](const HeldOutRow& r) { return r.validation.inlier; })
      .add("rows", "of its residual", [](const HeldOutRow& r) { return r.validation.prediction.r.size(); })
      .add("rows_inside", "those within the 95 % interval of their own",
           [](const HeldOutRow& r) { return r.validation.prediction.rows_inside(); })
      .add("squared_distance", "normalised: χ² with as many degrees of freedom as rows",
           [](const HeldOutRow& r) { return r.validation.prediction.squared_distance(); })
      .add_each(numbers, "residual_{}", "measurement minus prediction, in the sensor's units",
                [](const HeldOutRow& r) { return r.validation.prediction.r; })
      .add_each(numbers, "sigma_{}", "standard deviation of that: the prediction's and the sensor's noise together",
                [](const HeldOutRow& r) {
                  return Eigen::VectorXd(r.validation.prediction.covariance.diagonal().cwiseSqrt());
                });
}

std::vector<HeldOutRow> held_out_rows(const Estimate& estimate) {
  std::vector<HeldOutRow> rows;
  for (const Validation& v : estimate.held_out) rows.push_back({estimate.sensors[v.prediction.sensor].name, v});
  return rows;
}

/// Where the measurement of a keyframe puts the target.
struct FixRow {
  double t;
  KeyframeType type;
  Vector<3> position;
};

CsvTable<FixRow> fix_columns() {
  return CsvTable<FixRow>()
      .add("t", "time of the keyframe [s]", [](const FixRow& r) { return r.t; })
      .add("type", "of the keyframe: usbl or optical", [](const FixRow& r) { return name(r.type); })
      .add_xyz("{}_m",
               "where the measurement puts the target, seen from the estimated chaser, along the world's axes [m]",
               [](const FixRow& r) { return r.position; });
}

std::vector<FixRow> fix_rows(const Estimate& estimate) {
  std::vector<FixRow> rows;
  for (std::size_t k = 0; k < estimate.keyframes.size(); ++k)
    if (const Keyframe& keyframe = estimate.keyframes[k]; keyframe.measured_position)
      rows.push_back(
          {keyframe.t, keyframe.type, estimate.frame.world(estimate.chaser[k].act(*keyframe.measured_position))});
  return rows;
}

/// An estimate against the truth at a keyframe.
struct ErrorRow {
  const KeyframeError& error;
  const Frame& frame;
  OptionalVector three_sigma, three_sigma_rotation;
};

CsvTable<ErrorRow> error_columns() {
  CsvTable<ErrorRow> table;
  add_relative_error_columns(table);
  return table.add_xyz("three_sigma_r{}_deg", "3 σ of the relative orientation about the target's axes [deg]",
                       [](const ErrorRow& r) { return r.three_sigma_rotation; });
}

std::vector<ErrorRow> error_rows(const Estimate& estimate) {
  std::vector<ErrorRow> rows;
  for (std::size_t k = 0; k < estimate.errors.size(); ++k) {
    ErrorRow& row = rows.emplace_back(ErrorRow{estimate.errors[k], estimate.frame, {}, {}});
    if (estimate.uncertainty.empty()) continue;
    row.three_sigma = 3 * estimate.uncertainty[k].position_sigma();
    row.three_sigma_rotation = estimate.uncertainty[k].rotation_sigma();
    if (row.three_sigma_rotation) *row.three_sigma_rotation *= 3 * kDegrees;
  }
  return rows;
}

/// The truth at the keyframes, where there is one.
std::string truth_tum(const Estimate& estimate, const Scenario& scenario, const Body& body) {
  std::string text = tum_header;
  for (const Keyframe& keyframe : estimate.keyframes)
    if (const auto pose = pose_at(body.truth, keyframe.t)) {
      const SE3 there = estimate.frame.world(*pose);
      text += tum_row(keyframe.t, there.translation(),
                      scenario.truth_orientation ? std::optional(there.rotation()) : std::nullopt);
    }
  return text;
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
  if (!body.truth.empty()) write_file(folder / (who + "_truth.tum"), truth_tum(estimate, scenario, body));
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
  write_file(folder / "errors.csv", error_columns().text(error_rows(estimate)));
  write_file(folder / "target_fixes.csv", fix_columns().text(fix_rows(estimate)));
  write_file(folder / "weights.csv", weight_columns().text(weight_rows(estimate)));
  if (!estimate.held_out.empty()) {
    Eigen::Index rows = 0;
    for (const Validation& v : estimate.held_out) rows = std::max(rows, v.prediction.r.size());
    write_file(folder / "held_out.csv", held_out_columns(rows).text(held_out_rows(estimate)));
  }
  write_file(folder / "summary.json", summary_json(estimate));
}

std::vector<CsvDescription> estimate_file_columns() {
  return {state_columns().describe("chaser_full.csv, target_full.csv"), error_columns().describe("errors.csv"),
          fix_columns().describe("target_fixes.csv"), weight_columns().describe("weights.csv"),
          held_out_columns(6).describe("held_out.csv")};
}

}  // namespace tandem
