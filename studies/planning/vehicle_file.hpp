#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include <tandem/residuals/vehicle/vehicle_model.hpp>

namespace tandem {

/// Models are compiled for these numbers of actuators; one with fewer has idle ones besides, which push nothing.
using AnyVehicleModel = std::variant<VehicleModel<3>, VehicleModel<8>>;

/// A vehicle as its yaml says (docs/file_formats.md), in the axes of the project: x forward, y left, z up.
struct Vehicle {
  std::string name, description, source;
  std::vector<std::string> actuators;  ///< names of those that are not idle
  Vector<6> most_twist;                ///< of plans, either way [m/s, rad/s]
  AnyVehicleModel model;
};

/// A file, or the name of one that comes along (share/tandem/vehicles). Throws Error that begins with file and line:
/// keys that are unknown or missing, a mass or damping matrix that cannot be.
Vehicle read_vehicle(const std::string& name_or_file);

/// Names of those that come along.
std::vector<std::string> builtin_vehicles();

}  // namespace tandem
