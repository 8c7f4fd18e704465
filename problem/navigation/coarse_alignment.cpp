#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/problem/navigation/wrong_first_lines.hpp>

namespace tandem {
namespace {

constexpr double kLevelling = 1.0;        // s; averaging time of the specific force for roll and pitch
constexpr double kFirstSeconds = 5.0;     // s; maximum time of the first measurement that is used
constexpr double kLooseHeading = 3.0;     // rad, standard deviation
constexpr double kLoosePosition = 100.0;  // m, standard deviation

const EgoSensor* sensor_of(const NavigationData& data, EgoSensorType type) {
  for (const EgoSensor& sensor : data.sensors)
    if (sensor.type == type && !sensor.measurements.empty()) return &sensor;
  return nullptr;
}

/// Returns the first measurement at or after t, or null if it is not valid within 5 s.
const EgoMeasurement* first_of(const EgoSensor* sensor, double t) {
  if (!sensor) return nullptr;
  for (const EgoMeasurement& m : sensor->measurements)
    if (sensor->valid_at(m) >= t - kSameInstant) return sensor->valid_at(m) <= t + kFirstSeconds ? &m : nullptr;
  return nullptr;
}

/// Returns the earliest time from t on that is after all wrong first measurements of the first 5 s [s].
double after_wrong_first_lines(const NavigationData& data, double t) {
  double end = t;
  for (const EgoSensor& sensor : data.sensors)
    if (const std::size_t n = wrong_first_lines(sensor); n > 0)
      if (const double last = sensor.valid_at(sensor.measurements[n - 1]); last < t + kFirstSeconds)
        end = std::max(end, last + 2 * kSameInstant);
  return end;
}

bool has_samples(const NavigationData& data) { return data.imu && !data.imu->samples.empty(); }

/// Returns whether the chaser can navigate without IMU samples: by a heading sensor and a DVL. If there are no samples
/// at all, a GPS receiver may replace the DVL; Coasting then connects the keyframes.
bool navigates_without_samples(const NavigationData& data) {
  if (!sensor_of(data, EgoSensorType::heading)) return false;
  return sensor_of(data, EgoSensorType::dvl) || (sensor_of(data, EgoSensorType::gps) && !has_samples(data));
}

/// Returns the smallest rotation from body to world axes that makes the mean specific force after t point up.
SO3 level_orientation(const NavigationData& data, double t) {
  if (!data.imu) return SO3();
  ImuRecord record(*data.imu);
  for (const ImuSample& sample : data.imu->samples) {
    if (sample.t > t + kLevelling) break;
    record.add(sample);
  }
  const auto mean = record.mean(t, t + kLevelling);
  if (!mean || !(mean->specific_force.norm() > 0)) return SO3();
  const Vector<3> up = mean->specific_force.normalized(), axis = up.cross(Vector<3>::UnitZ());
  const double sine = axis.norm();
  if (sine < 1e-12) return up.z() > 0 ? SO3() : SO3::Exp({std::numbers::pi, 0, 0});
  return SO3::Exp(axis * (std::atan2(sine, up.z()) / sine));
}

/// Returns the rotation about the vertical [rad] that brings `from` closest to `to`.
double yaw_between(const SO3& from, const SO3& to) {
  const Matrix<3, 3> M = (from * to.inverse()).matrix();
  return std::atan2(M(0, 1) - M(1, 0), M(0, 0) + M(1, 1));
}

}  // namespace

std::optional<double> start_time(const NavigationData& data) {
  std::optional<double> without_imu, by_imu;
  for (const EgoSensor& sensor : data.sensors)
    if (!sensor.measurements.empty() && navigates_without_samples(data))
      without_imu = std::min(without_imu.value_or(HUGE_VAL), sensor.valid_at(sensor.measurements.front()));
  if (has_samples(data)) by_imu = data.imu->samples.front().t;
  return by_imu && !(without_imu && *without_imu < *by_imu - kFirstSeconds) ? by_imu : without_imu;
}

EgoState Alignment::rotated_about_vertical(double angle) const {
  const SO3 turn = SO3::Exp({0, 0, angle});
  EgoState result = state;
  result.pose = SE3(turn * state.pose.rotation(), state.pose.translation());
  if (velocity_from_dvl) result.velocity = turn.act(state.velocity);
  return result;
}

Alignment coarse_alignment(const NavigationData& data) {
  const EgoSensor* heading = sensor_of(data, EgoSensorType::heading);
  const EgoSensor* dvl = sensor_of(data, EgoSensorType::dvl);
  const EgoSensor* gps = sensor_of(data, EgoSensorType::gps);
  const EgoSensor* depth = sensor_of(data, EgoSensorType::depth);
  const std::optional<double> start = start_time(data);
  if (!start)
    throw BadInputError("navigation needs a source of motion: add an imu, or a heading sensor with a dvl or a gps");

  Alignment a;
  a.t = after_wrong_first_lines(data, *start);
  const bool inertial = data.imu && !data.imu->samples.empty() && data.imu->samples.front().t <= a.t + kLevelling;
  SO3 R = level_orientation(data, a.t);
  if (const EgoMeasurement* m = first_of(heading, a.t)) {
    const SO3 measured = m->rotation * heading->mount.rotation().inverse();
    R = inertial ? SO3::Exp({0, 0, yaw_between(R, measured)}) * R : measured;
    a.sigmas.rotation.z() = kLooseHeading;
  } else if (heading || gps || !data.earth.rate.isZero(0)) {
    a.heading_unknown = true;
    a.sigmas.rotation.z() = kLooseHeading;
  }
  Vector<3> p = Vector<3>::Zero();
  const EgoMeasurement* fix = first_of(gps, a.t);
  if (gps) a.sigmas.position.setConstant(kLoosePosition);
  if (fix) p = fix->value - R.act(gps->mount.translation());
  if (const EgoMeasurement* m = first_of(depth, a.t)) {
    p.z() = m->value.z() - R.act(depth->mount.translation()).z();
    a.sigmas.position.z() = kLoosePosition;
  }
  if (const EgoMeasurement* m = first_of(dvl, a.t)) {
    a.state.velocity = R.act(m->value);
    a.velocity_from_dvl = true;
  } else {
    a.sigmas.velocity.setConstant(3.0);
    if (fix && fix != &gps->measurements.back()) {
      const EgoMeasurement& next = *(fix + 1);
      if (next.t - fix->t > 0.5) a.state.velocity = (next.value - fix->value) / (next.t - fix->t);
    }
  }
  a.state.pose = SE3(R, p);
  return a;
}

}  // namespace tandem
