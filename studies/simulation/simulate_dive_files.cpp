#include <iterator>

#include <fmt/format.h>

#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/support/output_folder.hpp>

namespace tandem {
namespace {

/// "t,x,y,z" and rows of it.
class Csv {
 public:
  explicit Csv(const std::string& header) : text_(header + "\n") {}
  template <class V>
  void row(double t, const V& values) {
    fmt::format_to(std::back_inserter(text_), "{:.4f}", t);
    for (Eigen::Index i = 0; i < values.size(); ++i) fmt::format_to(std::back_inserter(text_), ",{:.9g}", values[i]);
    text_ += '\n';
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

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
      "sensors:             # positions and orientations in the body frame, which is the DVL's\n",
      name(options.grade), options.seed, options.minutes, options.latitude, options.keyframe_interval);
  text += fmt::format(
      "  imu: {{type: imu, file: imu.csv, accelerometer: {:g}, gyroscope: {:g}, accelerometer_bias_walk: {:g}, "
      "gyroscope_bias_walk: {:g},\n        initial_accelerometer_bias: {:g}, initial_gyroscope_bias: {:g}{}}}\n",
      imu.noise.accelerometer, imu.noise.gyroscope, imu.noise.accelerometer_bias_walk, imu.noise.gyroscope_bias_walk,
      imu.accelerometer_bias_spread(), imu.gyroscope_bias_spread(), place(imu.mount));
  for (const EgoSensor& sensor : dive.data.sensors)
    text += fmt::format("  {0}: {{type: {1}, file: {0}.csv, sigma: {2}{3}}}\n", sensor.name, name(sensor.type),
                        list(sensor.sigma), place(sensor.mount));
  return text;
}

std::string measurements(const EgoSensor& sensor) {
  switch (sensor.type) {
    case EgoSensorType::heading: {
      Csv csv("t,qx,qy,qz,qw");
      for (const EgoMeasurement& m : sensor.measurements) csv.row(m.t, m.rotation.quaternion().coeffs());
      return csv.text();
    }
    case EgoSensorType::depth: {
      Csv csv("t,z");
      for (const EgoMeasurement& m : sensor.measurements) csv.row(m.t, m.value.tail<1>());
      return csv.text();
    }
    case EgoSensorType::dvl:
    case EgoSensorType::gps:
      break;
  }
  Csv csv(sensor.type == EgoSensorType::dvl ? "t,vx,vy,vz" : "t,x,y,z");
  for (const EgoMeasurement& m : sensor.measurements) csv.row(m.t, m.value);
  return csv.text();
}

}  // namespace

std::vector<std::string> dive_files() {
  return {"scenario.yaml",      "imu.csv",       "dvl.csv", "depth.csv", "heading.csv", "gps.csv", "truth_chaser.tum",
          "truth_velocity.csv", "truth_bias.csv"};
}

void write_dive(const SimulatedDive& dive, const DiveOptions& options, const std::filesystem::path& folder) {
  write_file(folder / "scenario.yaml", yaml(dive, options));
  Csv imu("t,fx,fy,fz,wx,wy,wz"), velocity("t,vx,vy,vz"), bias("t,ax,ay,az,gx,gy,gz");
  for (const ImuSample& sample : dive.data.imu->samples) {
    Vector<6> row;
    row << sample.specific_force, sample.angular_rate;
    imu.row(sample.t, row);
  }
  write_file(folder / "imu.csv", imu.text());
  for (const EgoSensor& sensor : dive.data.sensors) write_file(folder / (sensor.name + ".csv"), measurements(sensor));

  std::string poses = "# t x y z qx qy qz qw\n";
  for (const auto& [t, state] : dive.truth) {
    const Vector<3> p = state.translation();
    const Vector<4> q = state.rotation().quaternion().coeffs();
    fmt::format_to(std::back_inserter(poses), "{:.4f} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n", t, p.x(),
                   p.y(), p.z(), q[0], q[1], q[2], q[3]);
    velocity.row(t, state.velocity());
  }
  write_file(folder / "truth_chaser.tum", poses);
  write_file(folder / "truth_velocity.csv", velocity.text());
  for (const auto& [t, value] : dive.biases) bias.row(t, value);
  write_file(folder / "truth_bias.csv", bias.text());
}

}  // namespace tandem
