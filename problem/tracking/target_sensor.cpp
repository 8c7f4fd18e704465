#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/residuals/direction.hpp>

namespace tandem {

using detail::placed_by, detail::placed_in_space_by;

// Each placement is defined in its source file, e.g. place_position.cpp.
static constexpr SensorTraits kTable[] = {
    {"position", measured::position, placed_by<struct PlacePosition>},
    {"pose", measured::position | measured::rotation, placed_by<struct PlacePose>},
    {"range_bearing", measured::range | measured::direction, placed_by<struct PlaceRangeBearing>},
    {"bearing", measured::direction, placed_by<struct PlaceBearing>},
    {"range", measured::range, placed_by<struct PlaceRange>},
    {"usbl_spherical", measured::range | measured::angles, placed_in_space_by<struct PlaceUsblSpherical>},
};

/// Returns a row of the table. An unknown name is a compile-time error.
static consteval const SensorTraits& of(std::string_view name) {
  for (const SensorTraits& traits : kTable)
    if (traits.name == name) return traits;
  throw "no such sensor";
}

constinit const SensorType SensorType::position = of("position"), SensorType::pose = of("pose"),
                           SensorType::range_bearing = of("range_bearing"), SensorType::bearing = of("bearing"),
                           SensorType::range = of("range"), SensorType::usbl_spherical = of("usbl_spherical");

std::span<const SensorTraits> sensor_types() { return kTable; }

int rows(SensorType type, bool planar) {
  if (planar && !type->place.in_plane) return 0;
  int rows = 0;
  const auto add = [&](unsigned part, int in_space, int in_plane) {
    if (type->has(part)) rows += planar ? in_plane : in_space;
  };
  add(measured::position, 3, 2);
  add(measured::rotation, 3, 1);
  add(measured::range, 1, 1);
  add(measured::direction, 2, 1);
  add(measured::angles, 2, 0);
  add(measured::height, 1, 0);
  return rows;
}

std::optional<Vector<3>> TargetSensor::position(const Measurement& m) const {
  if (type->has(measured::position)) return m.position;
  if (type->has(measured::range) && type->has(measured::direction | measured::angles))
    return m.range * Direction<3>(m.azimuth, m.elevation).unit();
  return {};
}

SE3 TargetSensor::pose_in_chaser(const Measurement& m) const {
  return mount * SE3(m.rotation, m.position) * marker.inverse();
}

std::optional<Vector<3>> TargetSensor::position_in_chaser(const Measurement& m) const {
  const auto seen = position(m);
  if (!seen) return {};
  if (type->has(measured::rotation)) return pose_in_chaser(m).translation();
  return mount.act(*seen);
}

std::string why_unsupported(const TargetSensor& sensor) {
  if (!sensor.error) return "";
  return why_unsupported(
      *sensor.error, "a " + std::string(name(sensor.type)), sensor.type->has(measured::position | measured::range),
      sensor.type->has(measured::position | measured::rotation | measured::direction | measured::angles));
}

}  // namespace tandem
