#include <cmath>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/fit/fit_files.hpp>
#include <tandem/studies/navigation_results/navigation_files.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/state_columns.hpp>
#include <tandem/studies/support/tum.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

using OptionalVector = std::optional<Vector<3>>;
using OptionalNumber = std::optional<double>;

/// The chaser at a keyframe, in the scenario's frame.
struct StateRow {
  double t;
  Vector<3> position;
  std::optional<SO3> orientation;
  Vector<3> velocity;
  OptionalVector accelerometer_bias, gyroscope_bias;
  Eigen::MatrixXd covariance;  ///< covariance of the pose; may be empty
  OptionalVector velocity_sigma, accelerometer_bias_sigma, gyroscope_bias_sigma;
};

StateRow state_row(const NavigationStudy& study, std::size_t k) {
  const Navigation& navigation = study.navigation;
  const Frame& frame = study.scenario.frame;
  const auto& [t, state] = navigation.states[k];
  const bool imu = navigation.data.imu.has_value();
  Matrix<6, 6> axes = Matrix<6, 6>::Zero();
  axes.topLeftCorner<3, 3>() = frame.body_axes();
  axes.bottomRightCorner<3, 3>() = frame.body_axes();
  const SE3 pose = frame.world(state.pose);
  StateRow row{t, pose.translation(), pose.rotation(), frame.world(state.velocity), {}, {}, {}, {}, {}, {}};
  if (imu) {
    const Vector<6> bias = axes * state.bias;
    row.accelerometer_bias = bias.head<3>();
    row.gyroscope_bias = bias.tail<3>();
  }
  if (navigation.covariance.empty()) return row;
  const EgoCovariance& covariance = navigation.covariance[k];
  row.covariance = axes * covariance.pose * axes.transpose();
  row.velocity_sigma = frame.world(Vector<3>(covariance.velocity.diagonal().cwiseSqrt())).cwiseAbs();
  if (imu) {
    const Vector<6> sigma = covariance.bias.diagonal().cwiseSqrt();
    row.accelerometer_bias_sigma = sigma.head<3>();
    row.gyroscope_bias_sigma = sigma.tail<3>();
  }
  return row;
}

CsvTable<StateRow> state_columns() {
  CsvTable<StateRow> table;
  add_pose_columns(table);
  table.add_xyz("v{}", "velocity along the world axes [m/s]", [](const StateRow& r) { return r.velocity; })
      .add_xyz("ba{}", "bias of the accelerometer along its axes [m/s²]",
               [](const StateRow& r) { return r.accelerometer_bias; })
      .add_xyz("bg{}", "bias of the gyroscope about its axes [rad/s]",
               [](const StateRow& r) { return r.gyroscope_bias; });
  add_covariance_columns(table);
  return table
      .add_xyz("sigma_v{}", "standard deviation of the velocity [m/s]",
               [](const StateRow& r) { return r.velocity_sigma; })
      .add_xyz("sigma_ba{}", "standard deviation of the accelerometer's bias [m/s²]",
               [](const StateRow& r) { return r.accelerometer_bias_sigma; })
      .add_xyz("sigma_bg{}", "standard deviation of the gyroscope's bias [rad/s]",
               [](const StateRow& r) { return r.gyroscope_bias_sigma; });
}

struct ErrorRow {
  const NavigationError& error;
  const Frame& frame;
};

CsvTable<ErrorRow> error_columns() {
  const auto norm = [](const OptionalVector& v, double unit = 1) {
    return v ? OptionalNumber(unit * v->norm()) : OptionalNumber();
  };
  const auto world = [](const ErrorRow& r, const OptionalVector& v) {
    return v ? OptionalVector(r.frame.world(*v)) : OptionalVector();
  };
  const auto bound = [](const OptionalVector& sigma, double unit = 1) {
    return sigma ? OptionalVector(unit * Vector<3>(3 * sigma->cwiseAbs())) : OptionalVector();
  };
  return CsvTable<ErrorRow>()
      .add("t", "time at which estimate and truth are compared [s]", [](const ErrorRow& r) { return r.error.t; })
      .add("position_error_m", "position error, magnitude [m]",
           [=](const ErrorRow& r) { return norm(r.error.position); })
      .add("horizontal_error_m", "horizontal position error, magnitude [m]",
           [](const ErrorRow& r) {
             return r.error.position ? OptionalNumber(horizontal(*r.error.position)) : OptionalNumber();
           })
      .add("orientation_error_deg", "orientation error, rotation angle [deg]",
           [=](const ErrorRow& r) { return norm(r.error.orientation, kDegrees); })
      .add("velocity_error_m_s", "velocity error, magnitude [m/s]",
           [=](const ErrorRow& r) { return norm(r.error.velocity); })
      .add_xyz("error_{}_m", "position error, estimate minus truth, along the world axes [m]",
               [=](const ErrorRow& r) { return world(r, r.error.position); })
      .add_xyz("error_r{}_deg", "orientation error, a rotation vector about the body axes [deg]",
               [](const ErrorRow& r) {
                 return r.error.orientation ? OptionalVector(kDegrees * Vector<3>(r.frame.body(*r.error.orientation)))
                                            : OptionalVector();
               })
      .add_xyz("error_v{}_m_s", "velocity error, estimate minus truth, along the world axes [m/s]",
               [=](const ErrorRow& r) { return world(r, r.error.velocity); })
      .add_xyz("three_sigma_{}_m", "3σ bound of the position along the world axes [m]",
               [=](const ErrorRow& r) { return bound(world(r, r.error.position_sigma)); })
      .add_xyz("three_sigma_r{}_deg", "3σ bound of the orientation about the body axes [deg]",
               [=](const ErrorRow& r) { return bound(r.error.orientation_sigma, kDegrees); })
      .add_xyz("three_sigma_v{}_m_s", "3σ bound of the velocity along the world axes [m/s]",
               [=](const ErrorRow& r) { return bound(world(r, r.error.velocity_sigma)); })
      .add("pose_nees", "normalised estimation error squared (NEES) of the pose: 6 on average if consistent",
           [](const ErrorRow& r) { return r.error.pose_nees; })
      .add("position_nees", "NEES of the position: 3 on average if consistent",
           [](const ErrorRow& r) { return r.error.position_nees; });
}

struct WeightRow {
  std::string sensor;
  double t, weight;
};

CsvTable<WeightRow> weight_columns() {
  return CsvTable<WeightRow>()
      .add("sensor", "name of the sensor", [](const WeightRow& r) { return r.sensor; })
      .add("t", "time when the measurement was valid [s]", [](const WeightRow& r) { return r.t; })
      .add("weight", "weight that the robust loss gives the measurement, below 0.5",
           [](const WeightRow& r) { return r.weight; });
}

std::vector<WeightRow> weight_rows(const Navigation& navigation) {
  std::vector<WeightRow> rows;
  for (std::size_t i = 0; i < navigation.placed.size(); ++i)
    if (const PlacedEgoMeasurement& m = navigation.placed[i]; navigation.weight[i] < kDownweightThreshold)
      rows.push_back({navigation.data.sensors[m.sensor].name, m.t, navigation.weight[i]});
  return rows;
}

struct FixRow {
  std::string sensor;
  double t;
  Vector<3> position;
};

CsvTable<FixRow> fix_columns() {
  return CsvTable<FixRow>()
      .add("t", "stamp of the fix [s]", [](const FixRow& r) { return r.t; })
      .add("sensor", "name of the gps sensor", [](const FixRow& r) { return r.sensor; })
      .add_xyz("{}_m", "measured position along the world axes [m]", [](const FixRow& r) { return r.position; });
}

std::vector<FixRow> fix_rows(const NavigationStudy& study) {
  std::vector<FixRow> rows;
  for (const EgoSensor& sensor : study.navigation.data.sensors)
    if (sensor.type == EgoSensorType::gps)
      for (const EgoMeasurement& m : sensor.measurements)
        rows.push_back({sensor.name, m.t, study.scenario.frame.world(m.value)});
  return rows;
}

CsvTable<GpsOutage> outage_columns() {
  return CsvTable<GpsOutage>()
      .add("from", "last fix before the outage, or start of the recording [s]",
           [](const GpsOutage& o) { return o.from; })
      .add("to", "first fix after the outage, or end of the recording [s]", [](const GpsOutage& o) { return o.to; })
      .add("distance_m", "true distance travelled during the outage [m]", [](const GpsOutage& o) { return o.distance; })
      .add("drift_m", "horizontal error at the end of the outage [m]", [](const GpsOutage& o) { return o.drift; })
      .add("largest_m", "largest horizontal error during the outage [m]", [](const GpsOutage& o) { return o.largest; });
}

/// Returns the true poses at the keyframes, in the estimate's world. If the truth is that of an antenna, the estimated
/// orientation is used to subtract the lever arm.
std::string truth_tum(const NavigationStudy& study) {
  const NavigationComparison& comparison = study.comparison;
  std::string text;
  for (const auto& [t, state] : study.navigation.states) {
    auto pose = pose_at(study.scenario.truth_chaser, t);
    if (!pose) continue;
    *pose = comparison.to_estimate * *pose;
    const Vector<3> arm = state.pose.rotation().act(comparison.point);
    const SE3 truth = study.scenario.frame.world(SE3(pose->rotation(), pose->translation() - arm));
    text += tum_row(t, truth.translation(),
                    study.scenario.truth_orientation ? std::optional(truth.rotation()) : std::nullopt);
  }
  return text.empty() ? text : tum_header + text;
}

}  // namespace

void write_navigation(const NavigationStudy& study, const std::filesystem::path& folder) {
  const CsvTable<StateRow> table = state_columns();
  std::string tum = tum_header, full = table.header();
  for (std::size_t k = 0; k < study.navigation.states.size(); ++k) {
    const StateRow row = state_row(study, k);
    tum += tum_row(row.t, row.position, row.orientation);
    full += table.row(row);
  }
  std::vector<ErrorRow> errors;
  for (const NavigationError& error : study.comparison.errors) errors.push_back({error, study.scenario.frame});
  write_file(folder / "chaser.tum", tum);
  write_file(folder / "chaser_full.csv", full);
  write_file(folder / "errors.csv", error_columns().text(errors));
  write_file(folder / "weights.csv", weight_columns().text(weight_rows(study.navigation)));
  write_fit(study.navigation.fit, folder);
  if (!study.navigation.at.empty()) write_states_at(study.navigation.at, study.scenario.frame, false, folder);
  write_file(folder / "chaser_fixes.csv", fix_columns().text(fix_rows(study)));
  write_file(folder / "gps_outages.csv", outage_columns().text(study.comparison.outages));
  if (const std::string truth = truth_tum(study); !truth.empty()) write_file(folder / "chaser_truth.tum", truth);
  write_file(folder / "summary.json", navigation_json(study));
}

std::vector<FileDescription> navigation_file_columns() {
  return {state_columns().describe("chaser_full.csv"),
          error_columns().describe("errors.csv"),
          weight_columns().describe("weights.csv"),
          fit_file_columns(),
          fix_columns().describe("chaser_fixes.csv"),
          outage_columns().describe("gps_outages.csv"),
          states_at_columns(false)};
}

}  // namespace tandem
