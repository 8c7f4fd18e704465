#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/scenario/quaternion.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>

namespace tandem {
namespace {

constexpr double kPole = 1e-6;  // rad: this close to straight up, an azimuth means nothing

SO3 rotation(const double* xyzw) {
  const auto R = rotation_from(xyzw);
  if (!R) throw Error(not_a_rotation(xyzw));
  return *R;
}

double range(double value) {
  if (value > 0) return value;
  throw Error(fmt::format("range {:g} m; a range must be above zero", value));
}

/// Azimuth and elevation, or the bearing in the plane, from `row` on.
void read_direction(SensorType type, const double* row, const Frame& frame, bool planar, Measurement& m) {
  if (std::abs(row[0]) > 2 * std::numbers::pi)
    throw Error(fmt::format("{} {:g} is beyond two pi; angles are in radians", planar ? "bearing" : "azimuth", row[0]));
  m.azimuth = frame.angle(row[0]);
  if (planar) return;
  const double from_pole = 0.5 * std::numbers::pi - std::abs(row[1]);
  if (from_pole < -kPole)
    throw Error(
        fmt::format("elevation {:g} rad is beyond the pole of its chart (pi/2); angles are in radians", row[1]));
  if (type == SensorType::usbl_spherical && from_pole < kPole)
    throw Error(
        fmt::format("elevation {:g} rad is at the pole of its chart (pi/2), where an azimuth means nothing", row[1]));
  m.elevation = frame.angle(row[1]);
}

}  // namespace

std::string columns(SensorType type, bool planar) {
  switch (type) {
    case SensorType::position:
      return planar ? "t,x,y" : "t,x,y,z";
    case SensorType::pose:
      return planar ? "t,x,y,yaw" : pose_columns;
    case SensorType::range_bearing:
      return planar ? "t,range,bearing" : "t,range,azimuth,elevation";
    case SensorType::bearing:
      return planar ? "t,bearing" : "t,azimuth,elevation";
    case SensorType::range:
      return "t,range";
    case SensorType::usbl_spherical:
      break;
  }
  return "t,range,azimuth,elevation";
}

std::string columns(EgoSensorType type) {
  switch (type) {
    case EgoSensorType::dvl:
      return "t,vx,vy,vz";
    case EgoSensorType::depth:
      return "t,z";
    case EgoSensorType::gps:
      return "t,x,y,z";
    case EgoSensorType::heading:
      break;
  }
  return "t,qx,qy,qz,qw";
}

bool may_repeat_times(SensorType type) { return type != SensorType::position && type != SensorType::pose; }

Measurement target_measurement(SensorType type, const double* row, const Frame& frame, bool planar) {
  Measurement m;
  m.t = *row++;
  const auto point = [&] { return frame.body(planar ? Vector<3>(row[0], row[1], 0) : Vector<3>(row)); };
  switch (type) {
    case SensorType::position:
      m.position = point();
      break;
    case SensorType::pose:
      m.position = point();
      m.rotation = frame.body(planar ? SO3::Exp({0, 0, row[2]}) : rotation(row + 3));
      break;
    case SensorType::range_bearing:
    case SensorType::usbl_spherical:
      m.range = range(row[0]);
      read_direction(type, row + 1, frame, planar, m);
      break;
    case SensorType::bearing:
      read_direction(type, row, frame, planar, m);
      break;
    case SensorType::range:
      m.range = range(row[0]);
      break;
  }
  return m;
}

EgoMeasurement ego_measurement(EgoSensorType type, const double* row, const Frame& frame) {
  EgoMeasurement m{*row++};
  switch (type) {
    case EgoSensorType::dvl:
      m.value = frame.body(Vector<3>(row));
      break;
    case EgoSensorType::depth:
      m.value = frame.world(Vector<3>(0, 0, row[0]));
      break;
    case EgoSensorType::gps:
      m.value = frame.world(Vector<3>(row));
      break;
    case EgoSensorType::heading:
      m.rotation = frame.world(SE3(rotation(row), Vector<3>::Zero())).rotation();
      break;
  }
  return m;
}

ImuSample imu_sample(const double* row, const Frame& frame) {
  return {row[0], frame.body(Vector<3>(row + 1)), frame.body(Vector<3>(row + 4))};
}

Stamped<SE3> world_pose(const double* row, const Frame& frame, bool planar) {
  return {row[0], inner_pose(SE3(rotation(row + 4), Vector<3>(row + 1)), frame, planar)};
}

SE3 inner_pose(const SE3& as_written, const Frame& frame, bool planar) {
  const SE3 pose = frame.world(as_written);
  return planar ? in_space(in_group<SE2>(pose)) : pose;
}

}  // namespace tandem
