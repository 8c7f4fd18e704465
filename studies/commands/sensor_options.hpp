#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// A sensor, or a kind of noise, that an option names.
struct NamedByOption {
  std::string option, name;
};

/// The value that an option gives it; without a name, it is for all.
template <class T>
struct SetByOption : NamedByOption {
  T value;
};

/// What options say about sensors, the target's and the chaser's own alike.
struct SensorOptions {
  std::vector<NamedByOption> without{};
  std::vector<SetByOption<std::vector<double>>> noise{};
  std::vector<SetByOption<Loss>> losses{};    ///< of "SENSOR.orientation", too, and "orientation", that of all
  std::vector<SetByOption<double>> delays{};  ///< s
  std::vector<SetByOption<StayingError>> errors{};
  std::vector<SetByOption<int>> hold_out{};  ///< every so many-th

  /// The loss of all measurements, and of all orientations, where one was given.
  std::optional<Loss> loss() const, orientation_loss() const;
};

/// --without, --noise-from, --noise, --loss, --delay, --error; with a target --hold-out, where that is wanted.
void add_sensors(CommandOptions& option, SensorOptions& sensors);
void add_hold_out(CommandOptions& option, SensorOptions& sensors);

/// The sensors of a scenario that a command works with.
struct SensorsInUse {
  bool target, own;
};

/// Leaves sensors out and sets noises, losses, delays and held-out measurements of a scenario, as its files would have
/// said. Throws Error on names that there are not among the sensors in use, or, of --noise-from, in the folder, and on values
/// that do not fit them.
void apply(const SensorOptions& sensors, SensorsInUse in_use, Scenario& scenario);

/// Throws Error, with the names that there are, where it is none of the chaser's own sensors, or where its delay is estimated as an
/// error that stays.
void check_delayed(const NavigationData& data, const NamedByOption& sensor);
/// Parses a sensor's name.
NamedByOption parse_name(const std::string& option, const std::string& text);

}  // namespace tandem
