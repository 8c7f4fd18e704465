#pragma once

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// Values of the options for the navigation of the chaser by its own sensors.
struct OwnSensorOptions {
  NavigationOptions navigation;
  bool no_earth_rotation = false;
};

/// Heading of these options in --help.
inline const char* const kOwnSensors = "Chaser's own sensors";

/// Adds --alignment, --dvl-scale and --preintegrated-dvl. For whole recordings (not online), also adds --vibration and
/// --no-earth-rotation. They are advanced options unless `everyday`.
void add_own_sensors(CommandOptions& option, OwnSensorOptions& own, bool recording, bool everyday = false);

/// Applies --no-earth-rotation to the data. Throws Error if an option needs a sensor that is not in use.
void apply(const OwnSensorOptions& own, NavigationData& data);

}  // namespace tandem
