#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include <fmt/format.h>

#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/scenario/quaternion.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>

namespace tandem {
namespace {

constexpr double kPole = 1e-6;  // rad; closer to the vertical, the azimuth is undefined

SO3 rotation(const double* xyzw) {
  const auto R = rotation_from(xyzw);
  if (!R) throw Error(quaternion_error(xyzw));
  return *R;
}

double range(double value) {
  if (value > 0) return value;
  throw Error(fmt::format("range {:g} m; a range must be above zero", value));
}

/// Reads azimuth and elevation, or in the plane the bearing. `angles`: the residual compares the angles themselves,
/// which are singular at the poles, instead of the direction.
void read_direction(const double* row, bool angles, const Frame& frame, bool planar, Measurement& m) {
  if (std::abs(row[0]) > 2 * std::numbers::pi)
    throw Error(
        fmt::format("{} {:g} is outside [-2 pi, 2 pi]; angles are in radians", planar ? "bearing" : "azimuth", row[0]));
  m.azimuth = frame.angle(row[0]);
  if (planar) return;
  const double from_pole = 0.5 * std::numbers::pi - std::abs(row[1]);
  if (from_pole < -kPole)
    throw Error(fmt::format("elevation {:g} is outside [-pi/2, pi/2]; angles are in radians", row[1]));
  if (angles && from_pole < kPole)
    throw Error(fmt::format("elevation {:g} rad is vertical, where the azimuth is undefined", row[1]));
  m.elevation = frame.angle(row[1]);
}

/// One part of a target measurement in a file: its column names, and the function that reads them.
struct PartColumns {
  unsigned part;
  std::string_view in_space, in_plane;
  void (*read)(const double* row, const Frame& frame, bool planar, Measurement& m);
};

/// All parts, in the order of their columns.
constexpr PartColumns kParts[] = {
    {measured::position, ",x,y,z", ",x,y",
     [](const double* row, const Frame& frame, bool planar, Measurement& m) {
       m.position = frame.body(Vector<3>(row[0], row[1], planar ? 0 : row[2]));
     }},
    {measured::rotation, ",qx,qy,qz,qw", ",yaw",
     [](const double* row, const Frame& frame, bool planar, Measurement& m) {
       m.rotation = frame.body(planar ? SO3::Exp({0, 0, row[0]}) : rotation(row));
     }},
    {measured::range, ",range", ",range",
     [](const double* row, const Frame&, bool, Measurement& m) { m.range = range(row[0]); }},
    {measured::direction, ",azimuth,elevation", ",bearing",
     [](const double* row, const Frame& frame, bool planar, Measurement& m) {
       read_direction(row, false, frame, planar, m);
     }},
    {measured::angles, ",azimuth,elevation", "",
     [](const double* row, const Frame& frame, bool planar, Measurement& m) {
       read_direction(row, true, frame, planar, m);
     }},
    {measured::height, ",z", "",
     [](const double* row, const Frame& frame, bool, Measurement& m) {
       m.height = frame.world(Vector<3>(0, 0, row[0])).z();
     }},
};

bool is_zero(const double* xyzw) {
  return std::all_of(xyzw, xyzw + 4, [](double x) { return x == 0; });
}

std::size_t num_values(std::string_view columns) {
  return std::size_t(std::count(columns.begin(), columns.end(), ','));
}

}  // namespace

bool is_missing(std::span<const double> values, std::span<const double> declared) {
  constexpr double kMarkers[] = {9999, -9999, 99999, -99999, -32768};
  const auto any = [&](std::span<const double> markers) {
    return std::any_of(values.begin(), values.end(), [&](double x) {
      return std::isnan(x) || std::find(markers.begin(), markers.end(), x) != markers.end();
    });
  };
  return any(declared) || any(kMarkers) ||
         std::all_of(values.begin(), values.end(), [](double x) { return std::abs(x) == 32.768; });
}

std::string columns(SensorType type, bool planar) {
  std::string columns = "t";
  for (const PartColumns& part : kParts)
    if (type->has(part.part)) columns += planar ? part.in_plane : part.in_space;
  return columns;
}

bool may_repeat_times(SensorType type) { return !type->has(measured::position); }

Measurement target_measurement(SensorType type, const double* row, const Frame& frame, bool planar,
                               std::span<const double> missing) {
  Measurement m;
  m.t = *row++;
  const bool zero_range = type->has(measured::range) && row[0] == 0;
  const bool zero_rotation = type->has(measured::rotation) && !planar && is_zero(row + 3);
  if (zero_range || zero_rotation || is_missing({row, num_values(columns(type, planar))}, missing)) {
    m.position.setConstant(NAN);
    m.range = m.azimuth = m.elevation = m.height = NAN;
    return m;
  }
  for (const PartColumns& part : kParts) {
    if (!type->has(part.part)) continue;
    part.read(row, frame, planar, m);
    const std::string_view columns = planar ? part.in_plane : part.in_space;
    row += std::count(columns.begin(), columns.end(), ',');
  }
  return m;
}

EgoMeasurement ego_measurement(EgoSensorType type, const double* row, const Frame& frame,
                               std::span<const double> missing) {
  EgoMeasurement m{*row++};
  if ((type->reading == EgoReading::orientation && is_zero(row)) ||
      is_missing({row, num_values(type->columns)}, missing)) {
    m.value.setConstant(NAN);
    return m;
  }
  switch (type->reading) {
    case EgoReading::body_vector:
      m.value = frame.body(Vector<3>(row));
      break;
    case EgoReading::world_vector:
      m.value = frame.world(Vector<3>(row));
      break;
    case EgoReading::world_height:
      m.value = frame.world(Vector<3>(0, 0, row[0]));
      break;
    case EgoReading::orientation:
      m.rotation = frame.world(rotation(row));
      break;
  }
  return m;
}

Eigen::VectorXd numbers(EgoSensorType type, const EgoMeasurement& m) {
  switch (type->reading) {
    case EgoReading::world_height:
      return m.value.tail<1>();
    case EgoReading::orientation:
      return m.rotation.quaternion().coeffs();
    default:
      return m.value;
  }
}

ImuSample imu_sample(const double* row, const Frame& frame, std::span<const double> missing) {
  if (is_missing({row + 1, num_values(imu_columns)}, missing)) {
    const Vector<3> nothing = Vector<3>::Constant(NAN);
    return {row[0], nothing, nothing};
  }
  return {row[0], frame.body(Vector<3>(row + 1)), frame.body(Vector<3>(row + 4))};
}

bool is_missing_pose(const double* row) { return is_zero(row + 4) || is_missing({row + 1, 7}, {}); }

Stamped<SE3> world_pose(const double* row, const Frame& frame, bool planar) {
  if (is_missing_pose(row)) return {row[0], SE3(SO3(), Vector<3>::Constant(NAN))};
  return {row[0], internal_pose(SE3(rotation(row + 4), Vector<3>(row + 1)), frame, planar)};
}

SE3 internal_pose(const SE3& as_written, const Frame& frame, bool planar) {
  const SE3 pose = frame.world(as_written);
  return planar ? in_space(in_group<SE2>(pose)) : pose;
}

}  // namespace tandem
