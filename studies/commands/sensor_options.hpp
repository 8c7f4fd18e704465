#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// An option, and the name of the sensor or noise in its value.
struct NamedByOption {
  std::string option, name;
};

/// The setting of an option of the form NAME=VALUE. An empty name means all.
template <class T>
struct SetByOption : NamedByOption {
  T value;
};

/// Values of the sensor options, for target sensors and the chaser's own sensors.
struct SensorOptions {
  std::vector<NamedByOption> without{};
  std::vector<SetByOption<std::vector<double>>> noise{};
  std::vector<SetByOption<Loss>> losses{};    ///< names: SENSOR, SENSOR.orientation, or orientation (all sensors)
  std::vector<SetByOption<double>> delays{};  ///< s
  std::vector<SetByOption<SystematicError>> errors{};
  std::vector<SetByOption<int>> hold_out{};  ///< N: every N-th measurement

  /// Return the loss for all measurements, and for all measured orientations, if given.
  std::optional<Loss> loss() const, orientation_loss() const;
};

/// Adds --without, --noise-from, --noise, --loss, --delay and --error.
void add_sensors(CommandOptions& option, SensorOptions& sensors);
/// Adds --hold-out.
void add_hold_out(CommandOptions& option, SensorOptions& sensors);

/// The kinds of sensors that a command uses.
struct SensorsInUse {
  bool target, own;
};

/// Removes sensors and sets noise, losses, delays, systematic errors and held-out measurements of a scenario. Throws
/// Error on names that are not among the sensors in use (for --noise-from: not in the scenario), and on invalid values.
void apply(const SensorOptions& sensors, SensorsInUse in_use, Scenario& scenario);

/// Throws Error if `sensor` is not one of the chaser's own sensors, or if its delay is estimated as a systematic error.
void check_delay_is_fixed(const NavigationData& data, const NamedByOption& sensor);
/// Returns the option with its value as a name.
NamedByOption parse_name(const std::string& option, const std::string& text);

}  // namespace tandem
