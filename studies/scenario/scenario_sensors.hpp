#pragma once

#include <filesystem>
#include <string>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// What reading a sensor's file needs to know of its scenario.
struct SensorSurroundings {
  std::filesystem::path folder;
  Frame frame;
  bool planar = false;
  double first = 0, last = 0;                   ///< s: no measurement lies outside
  std::string span_of = "the odometry's span";  ///< what first and last are, for the error message
  bool rows = true;                             ///< to be read; false: settings only
  Stop stop{};                                  ///< of reading them
};

/// The type in an entry of `sensors:`, of a sensor that observes the target. Throws Error where there is no such type.
SensorType sensor_type(const YamlSection& entry);

/// A sensor out of its entry in `sensors:`. Throws Error naming file, line and reason.
TargetSensor read_sensor(const std::string& name, const YamlSection& entry, const SensorSurroundings& around);

/// usbl.csv or optical.csv, which are there without being declared; without its sigma, which the noise section gives.
TargetSensor read_undeclared_sensor(const std::string& name, SensorType type, const SensorSurroundings& around);

}  // namespace tandem
