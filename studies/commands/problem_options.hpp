#pragma once

#include <optional>
#include <string>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/own_sensor_options.hpp>
#include <tandem/studies/commands/sensor_options.hpp>

namespace tandem {

/// The group of options that say how the target moves.
inline constexpr const char* kTarget = "Target";

/// Which tracking problem the options mean.
struct ProblemRequest {
  std::string scenario;
  TrackingOptions target;  ///< but for the next two, see tracking_options()
  std::optional<Role> non_holonomic;
  std::optional<Role> limits;  ///< how surge and yaw rate are held
  SensorOptions sensors;
  OwnSensorOptions own;  ///< of a chaser that moves by its own sensors
  bool force = false;    ///< times that look like a mistake are taken
};

/// SCENARIO.
void add_scenario(CommandOptions& option, std::string& scenario, const std::string& help);
/// The scenario of that name or folder as it is. Reading stops (Stopped) at an interrupt, or a second after the time limit of
/// `stop`: what is solved next says where a limit was too short for it.
Scenario read_asked(const std::string& scenario, const Stop& stop);
/// What every command with a target has: SCENARIO, how the target moves, sensors. `limits`: --limits, too.
void add_problem(CommandOptions& option, ProblemRequest& request, bool limits);
/// --force: a recording whose times look like a mistake (implausible_times()) is taken all the same.
void add_force(CommandOptions& option, bool& force);
/// Throws Error where they do, unless forced.
void refuse_implausible_times(const Scenario& scenario, const std::string& name, bool force);
/// --max-keyframes and --force: of a whole recording.
void add_max_keyframes(CommandOptions& option, ProblemRequest& request);

/// The options of the tracking problem; limits are held as asked for, else hard where `hard_limits`, else soft. Throws
/// Error on options that need others.
TrackingOptions tracking_options(const ProblemRequest& request, bool hard_limits);
/// Those of navigating a chaser that is then estimated with its target: a loss for all measurements is for its own, too.
NavigationOptions navigation_options(const ProblemRequest& request);

/// The scenario, its sensors as the options say. Throws Error, also when it has no target, and on options about the
/// chaser's own sensors when it moves by odometry. `option`: to name the option that does not fit. Stops as read_asked().
Scenario read_problem(const ProblemRequest& request, const CommandOptions& option, const Stop& stop = {});
/// The same where a chaser alone will do.
Scenario read_any_problem(const ProblemRequest& request, const CommandOptions& option, const Stop& stop);
/// The same of a scenario's settings alone (read_settings), with a target or without.
Scenario read_problem_settings(const ProblemRequest& request, const CommandOptions& option, RowsIn rows);

/// The scenario with its chaser navigated by its own sensors (navigated()), under a progress line that begins with `line`.
/// Throws Stopped where an interrupt or `time_limit` [s] cuts it short: what would be compared is no longer one problem.
Scenario navigate_first(Scenario scenario, NavigationOptions options, const Output& output, const std::string& line,
                        double time_limit);

}  // namespace tandem
