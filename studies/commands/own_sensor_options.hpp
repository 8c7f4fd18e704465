#pragma once

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// What options say about how the chaser moves by its own sensors.
struct OwnSensorOptions {
  NavigationOptions navigation;
  bool no_earth_rotation = false;
};

/// The heading of these options.
inline const char* const kOwnSensors = "Chaser's own sensors";

/// --alignment, --dvl-scale and --preintegrated-dvl; of a recording, as against what comes in line by line, also
/// --vibration and --no-earth-rotation.
void add_own_sensors(CommandOptions& option, OwnSensorOptions& own, bool recording);

/// Throws Error when options ask for sensors that are not in use.
void apply(const OwnSensorOptions& own, NavigationData& data);

}  // namespace tandem
