#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// The words on a command line that say which tracking problem is meant, as they were typed; nothing where an option was
/// not given.
struct TrackingArguments {
  std::string scenario;
  std::optional<std::string> mode, model, junction, horizons, roll_pitch, non_holonomic, surge, yaw_rate, limits,
      max_keyframes;
  std::vector<std::string> loss, noise, hold_out;
  bool robust = false;
};

/// What the options mean. Throws Error on words that make no sense.
TrackingOptions tracking_options(const TrackingArguments& arguments);

/// The scenario with the noise, losses and held-out measurements that the arguments ask for. Throws Error.
Scenario scenario_with(const TrackingArguments& arguments);

/// The same of a scenario's settings alone (read_settings), by odometry or by the chaser's own sensors, with a target or
/// without. Losses may be of the chaser's own sensors too.
Scenario settings_with(const TrackingArguments& arguments, RowsIn rows);

}  // namespace tandem
