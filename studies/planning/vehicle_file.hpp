#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include <tandem/problem/planning/pursuit.hpp>
#include <tandem/residuals/vehicle/vehicle_model.hpp>

namespace tandem {

/// Vehicle model, compiled for 3 and for 8 actuators. Unused actuators are idle: they produce no force.
using AnyVehicleModel = std::variant<VehicleModel<3>, VehicleModel<8>>;

/// A vehicle read from a YAML file (docs/file_formats.md), in Tandem's axes: x forward, y left, z up.
struct Vehicle {
  std::string name, description, source;
  std::vector<std::string> actuators;  ///< names, without the idle ones
  Vector<6> most_twist;                ///< bounds on the magnitude of each twist component in plans [m/s, rad/s]
  AnyVehicleModel model;
};

/// Reads a YAML file, or the built-in vehicle of that name (share/tandem/vehicles). Throws Error that begins with file
/// and line if a key is unknown or missing, a number is out of range, or the mass or damping matrix is impossible.
Vehicle read_vehicle(const std::string& name_or_file);

/// Returns the speed and turn rate of a pure pursuit that leaves margins to the limits of a vehicle.
PursuitOptions pursuit_limits(const Vehicle& vehicle);

/// Returns the names of the built-in vehicles, sorted.
std::vector<std::string> builtin_vehicles();

}  // namespace tandem
