#include <array>

#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/residuals/direction.hpp>

namespace tandem {

std::string_view name(SensorType type) {
  static constexpr std::array<std::string_view, 6> names{"position", "pose",  "range_bearing",
                                                         "bearing",  "range", "usbl_spherical"};
  return names[static_cast<std::size_t>(type)];
}

int rows(SensorType type, bool planar) {
  switch (type) {
    case SensorType::position:
      return planar ? 2 : 3;
    case SensorType::pose:
      return planar ? 3 : 6;
    case SensorType::range_bearing:
      return planar ? 2 : 3;
    case SensorType::bearing:
      return planar ? 1 : 2;
    case SensorType::range:
      return 1;
    case SensorType::usbl_spherical:
      break;
  }
  return planar ? 0 : 3;
}

std::optional<Vector<3>> TargetSensor::position(const Measurement& m) const {
  switch (type) {
    case SensorType::position:
    case SensorType::pose:
      return m.position;
    case SensorType::range_bearing:
    case SensorType::usbl_spherical:
      return m.range * Direction<3>(m.azimuth, m.elevation).unit();
    case SensorType::bearing:
    case SensorType::range:
      break;
  }
  return {};
}

SE3 TargetSensor::pose_in_chaser(const Measurement& m) const {
  return mount * SE3(m.rotation, m.position) * marker.inverse();
}

std::optional<Vector<3>> TargetSensor::position_in_chaser(const Measurement& m) const {
  const auto seen = position(m);
  if (!seen) return {};
  if (type == SensorType::pose) return pose_in_chaser(m).translation();
  return mount.act(*seen);
}

}  // namespace tandem
