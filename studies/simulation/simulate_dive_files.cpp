#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/simulation/number_rows.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {
namespace {

CsvTable<NumberRow> columns_of(const std::string& names) {
  return number_columns(names, 4, [](const std::string&, double value) { return CsvCell::rounded(value, 9); });
}

std::string list(const Eigen::VectorXd& values) {
  return fmt::format("[{:.6g}]", fmt::join(values.data(), values.data() + values.size(), ", "));
}

std::string place(const SE3& mount) {
  std::string text;
  if (!mount.translation().isZero(0)) text += ", position: " + list(mount.translation());
  const Vector<4> q = mount.rotation().quaternion().coeffs();
  if (!q.head<3>().isZero(0)) text += fmt::format(", orientation: [{:.17g}]", fmt::join(q.data(), q.data() + 4, ", "));
  return text;
}

std::string yaml(const SimulatedDive& dive, const DiveOptions& options) {
  const ImuSensor& imu = *dive.data.imu;
  std::string text = fmt::format(
      "name: dive_{0}_{1}\n"
      "description: Simulated survey dive to 30 m of {2:g} minutes with sensors of {0} grade\n"
      "source: simulated by tandem, seed {1}\n"
      "frame: ENU-FLU\n"
      "latitude: {3:.10g}   # deg\n"
      "keyframe_interval: {4:g}\n"
      "sensors:             # positions and orientations in the body frame, which is the DVL frame\n",
      name(options.grade), options.seed, options.minutes, options.latitude, options.keyframe_interval);
  text += fmt::format(
      "  imu: {{type: imu, file: imu.csv, accelerometer: {:g}, gyroscope: {:g}, accelerometer_bias_walk: {:g}, "
      "gyroscope_bias_walk: {:g},\n        initial_accelerometer_bias: {:g}, initial_gyroscope_bias: {:g}{}}}\n",
      imu.noise.accelerometer, imu.noise.gyroscope, imu.noise.accelerometer_bias_walk, imu.noise.gyroscope_bias_walk,
      imu.accelerometer_bias_sigma(), imu.gyroscope_bias_sigma(), place(imu.mount));
  for (const EgoSensor& sensor : dive.data.sensors)
    text += fmt::format("  {0}: {{type: {1}, file: {0}.csv, sigma: {2}{3}}}\n", sensor.name, name(sensor.type),
                        list(sensor.sigma), place(sensor.mount));
  if (!options.target) return text;
  const TrackingNoise& noise = dive.tracking.noise;
  return text + fmt::format("noise:\n  usbl: {}\n  constant_twist: {}\n  constant_velocity: {}\n",
                            list(dive.tracking.sensors[0].sigma), list(noise.constant_twist),
                            list(noise.constant_velocity));
}

std::string measurements(const EgoSensor& sensor) {
  std::vector<NumberRow> rows;
  for (const EgoMeasurement& m : sensor.measurements) rows.push_back({m.t, numbers(sensor.type, m)});
  return columns_of(columns(sensor.type)).text(rows);
}

void write_target(const SimulatedDive& dive, const std::filesystem::path& folder) {
  std::vector<NumberRow> fixes;
  for (const Measurement& m : dive.tracking.sensors[0].measurements) fixes.push_back({m.t, m.position});
  write_file(folder / "usbl.csv", columns_of("t,x,y,z").text(fixes));
  std::string poses = tum_header;
  for (const auto& [t, pose] : dive.truth_target) poses += tum_row(t, pose, TumDecimals{4, 6, 9});
  write_file(folder / "truth_target.tum", poses);
}

}  // namespace

void write_dive(const SimulatedDive& dive, const DiveOptions& options, const std::filesystem::path& folder) {
  write_file(folder / "scenario.yaml", yaml(dive, options));
  std::vector<NumberRow> imu, velocities, biases;
  for (const ImuSample& sample : dive.data.imu->samples) {
    Vector<6> row;
    row << sample.specific_force, sample.angular_rate;
    imu.push_back({sample.t, row});
  }
  write_file(folder / "imu.csv", columns_of(imu_columns).text(imu));
  for (const EgoSensor& sensor : dive.data.sensors) write_file(folder / (sensor.name + ".csv"), measurements(sensor));

  std::string poses = tum_header;
  for (const auto& [t, state] : dive.truth) {
    poses += tum_row(t, state.translation(), state.rotation(), TumDecimals{4, 6, 9});
    velocities.push_back({t, state.velocity()});
  }
  write_file(folder / "truth_chaser.tum", poses);
  write_file(folder / "truth_velocity.csv", columns_of("t,vx,vy,vz").text(velocities));
  for (const auto& [t, value] : dive.biases) biases.push_back({t, value});
  write_file(folder / "truth_bias.csv", columns_of("t,ax,ay,az,gx,gy,gz").text(biases));
  if (options.target) write_target(dive, folder);
}

}  // namespace tandem
