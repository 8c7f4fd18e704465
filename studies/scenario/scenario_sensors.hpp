#pragma once

#include <filesystem>
#include <string>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// Properties of a scenario that are needed to read the files of its sensors.
struct SensorContext {
  std::filesystem::path folder;
  Frame frame;
  bool planar = false;
  double first = 0, last = 0;            ///< measurements outside this time span are errors [s]
  std::string span_of = "the odometry";  ///< the source of `first` and `last`, for the error message
  bool rows = true;                      ///< false: read the settings only
  Stop stop{};                           ///< stops reading
};

/// Returns the type of a target sensor from its entry in `sensors:`. Throws Error if the type is unknown.
SensorType sensor_type(const YamlSection& entry);

/// Reads a target sensor from its entry in `sensors:` and its file. Throws Error with file, line and reason.
TargetSensor read_sensor(const std::string& name, const YamlSection& entry, const SensorContext& context);

/// Reads usbl.csv or optical.csv, which need no entry in `sensors:`. The section `noise` gives their sigma later.
TargetSensor read_undeclared_sensor(const std::string& name, SensorType type, const SensorContext& context);

}  // namespace tandem
