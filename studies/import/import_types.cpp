#include <algorithm>

#include <tandem/studies/import/import_types.hpp>

namespace tandem {
namespace {

constexpr ImportQuantity kWorldPosition[] = {{"position", Quantity::length, 3},
                                             {"latitude", Quantity::angle, 1},
                                             {"longitude", Quantity::angle, 1},
                                             {"height", Quantity::length, 1},
                                             {"depth", Quantity::length, 1}};
constexpr ImportQuantity kOrientation[] = {{"quaternion_xyzw", Quantity::number, 4},
                                           {"quaternion_wxyz", Quantity::number, 4},
                                           {"roll", Quantity::angle, 1},
                                           {"pitch", Quantity::angle, 1},
                                           {"yaw", Quantity::angle, 1},
                                           {"heading", Quantity::angle, 1},
                                           {"euler", Quantity::angle, 3},
                                           {"magnetic_field", Quantity::magnetic_field, 3}};
constexpr ImportQuantity kHeight[] = {
    {"depth", Quantity::length, 1}, {"height", Quantity::length, 1}, {"pressure", Quantity::pressure, 1}};
constexpr ImportQuantity kBodyPosition[] = {{"position", Quantity::length, 3}};
constexpr ImportQuantity kVelocity[] = {{"velocity", Quantity::speed, 3}};
constexpr ImportQuantity kAcceleration[] = {{"acceleration", Quantity::acceleration, 3}};
constexpr ImportQuantity kAngularRate[] = {{"angular_rate", Quantity::angular_rate, 3}};
constexpr ImportQuantity kRange[] = {{"range", Quantity::length, 1}};
constexpr ImportQuantity kDirection[] = {{"azimuth", Quantity::angle, 1}, {"elevation", Quantity::angle, 1}};

void append(std::vector<Quantity>& to, Quantity quantity, int count) {
  to.insert(to.end(), static_cast<std::size_t>(count), quantity);
}

}  // namespace

const std::vector<ImportType>& import_types() {
  using enum ImportPart;
  static const std::vector<ImportType> types = {
      {"odometry", {world_position, world_orientation}, "", "chaser_odometry.tum", ""},
      {"truth_chaser", {world_position, world_orientation}, "", "truth_chaser.tum", ""},
      {"truth_target", {world_position, world_orientation}, "", "truth_target.tum", ""},
      {"position", {body_position}, "t,x,y,z", "", "[1, 1, 1]"},
      {"pose", {body_position, body_orientation}, "t,x,y,z,qx,qy,qz,qw", "", "[0.2, 0.2, 0.2, 0.05, 0.05, 0.05]"},
      {"range_bearing", {range, direction}, "t,range,azimuth,elevation", "", "[0.5, 0.03, 0.03]"},
      {"usbl_spherical", {range, direction}, "t,range,azimuth,elevation", "", "[0.5, 0.03, 0.03]"},
      {"bearing", {direction}, "t,azimuth,elevation", "", "[0.03, 0.03]"},
      {"range", {range}, "t,range", "", "[0.5]"},
      {"imu", {acceleration, angular_rate}, "t,fx,fy,fz,wx,wy,wz", "", ""},
      {"dvl", {velocity}, "t,vx,vy,vz", "", "[0.02, 0.02, 0.02]"},
      {"depth", {height}, "t,z", "", "[0.1]"},
      {"gps", {world_position}, "t,x,y,z", "", "[2, 2, 4]"},
      {"heading", {world_orientation}, "t,qx,qy,qz,qw", "", "[0.05, 0.05, 0.05]"}};
  return types;
}

const ImportType* find_import_type(std::string_view name) {
  for (const ImportType& type : import_types())
    if (type.name == name) return &type;
  return nullptr;
}

bool observes_target(const ImportType& type) {
  const ImportPart first = type.parts.front();
  return first == ImportPart::body_position || first == ImportPart::range || first == ImportPart::direction;
}

bool has_world_orientation(const ImportType& type) {
  return std::find(type.parts.begin(), type.parts.end(), ImportPart::world_orientation) != type.parts.end();
}

std::vector<std::string> import_type_names() {
  std::vector<std::string> names;
  for (const ImportType& type : import_types()) names.emplace_back(type.name);
  return names;
}

std::vector<Quantity> sigma_quantities(const ImportType& type) {
  std::vector<Quantity> result;
  for (const ImportPart part : type.parts) switch (part) {
      case ImportPart::world_position:
      case ImportPart::body_position:
        append(result, Quantity::length, 3);
        break;
      case ImportPart::world_orientation:
      case ImportPart::body_orientation:
        append(result, Quantity::angle, 3);
        break;
      case ImportPart::height:
      case ImportPart::range:
        append(result, Quantity::length, 1);
        break;
      case ImportPart::velocity:
        append(result, Quantity::speed, 3);
        break;
      case ImportPart::acceleration:
        append(result, Quantity::acceleration, 3);
        break;
      case ImportPart::angular_rate:
        append(result, Quantity::angular_rate, 3);
        break;
      case ImportPart::direction:
        append(result, Quantity::angle, 2);
        break;
    }
  return result;
}

std::span<const ImportQuantity> quantities(ImportPart part) {
  switch (part) {
    case ImportPart::world_position:
      return kWorldPosition;
    case ImportPart::world_orientation:
    case ImportPart::body_orientation:
      return kOrientation;
    case ImportPart::height:
      return kHeight;
    case ImportPart::body_position:
      return kBodyPosition;
    case ImportPart::velocity:
      return kVelocity;
    case ImportPart::acceleration:
      return kAcceleration;
    case ImportPart::angular_rate:
      return kAngularRate;
    case ImportPart::range:
      return kRange;
    case ImportPart::direction:
      return kDirection;
  }
  return {};
}

}  // namespace tandem
