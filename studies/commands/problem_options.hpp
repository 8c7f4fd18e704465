#pragma once

#include <optional>
#include <string>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/own_sensor_options.hpp>
#include <tandem/studies/commands/sensor_options.hpp>

namespace tandem {

/// Heading of the options for the motion of the target in --help.
inline constexpr const char* kTarget = "Target";
/// Heading of the options for the sensors.
inline constexpr const char* kSensors = "Sensors";

/// Values of the options that define a tracking problem.
struct ProblemRequest {
  std::string scenario;
  TrackingOptions target;  ///< without the next two members, which tracking_options() adds
  std::optional<Role> non_holonomic;
  std::optional<Role> limits;  ///< role of the limits of surge and yaw rate
  SensorOptions sensors;
  OwnSensorOptions own;  ///< for a chaser that moves by its own sensors
  bool force = false;    ///< accepts implausible times
};

/// Adds the positional argument SCENARIO.
void add_scenario(CommandOptions& option, std::string& scenario, const std::string& help);
/// Reads a scenario, given its folder or the name of a built-in one. Throws Stopped on an interrupt, or one second
/// after the time limit of `stop`. This grace period lets the later solve report a time limit that was too short.
Scenario read_requested_scenario(const std::string& scenario, const Stop& stop);
/// Adds SCENARIO, the target options and the sensor options; with `limits`, also --limits.
void add_problem(CommandOptions& option, ProblemRequest& request, bool limits);
/// Adds --force, which accepts recordings that implausible_times() reports.
void add_force(CommandOptions& option, bool& force);
/// Throws Error if implausible_times() reports the scenario, unless `force`.
void reject_implausible_times(const Scenario& scenario, const std::string& name, bool force);
/// Adds --max-keyframes and --force, for commands that read a whole recording.
void add_max_keyframes(CommandOptions& option, ProblemRequest& request);

/// Returns the options of the tracking problem. Without --limits, limits are hard if `hard_limits`, otherwise soft.
/// Throws Error if an option lacks another one that it needs.
TrackingOptions tracking_options(const ProblemRequest& request, bool hard_limits);
/// Returns the navigation options of the chaser. A loss given for all measurements also applies to its own sensors.
NavigationOptions navigation_options(const ProblemRequest& request);

/// Reads the scenario and applies the sensor options. Throws Error if it has no target sensor, and on own-sensor
/// options for a chaser that uses odometry; `option` supplies the option name. Throws Stopped like
/// read_requested_scenario().
Scenario read_problem(const ProblemRequest& request, const CommandOptions& option, const Stop& stop = {});
/// Like read_problem(), but also accepts scenarios without a target.
Scenario read_any_problem(const ProblemRequest& request, const CommandOptions& option, const Stop& stop);
/// Like read_any_problem(), but reads only the settings; see read_settings().
Scenario read_problem_settings(const ProblemRequest& request, const CommandOptions& option, RowsIn rows);

/// A scenario with the options of its problem.
struct ProblemOfWords {
  Scenario scenario;
  TrackingOptions target;
  NavigationOptions own;
};
/// Applies words of a command line, such as "--model=damped-twist", to a scenario as it was read. Throws Error on words
/// that do not apply to it.
ProblemOfWords apply_words(const std::vector<std::string>& words, Scenario scenario);

/// Navigates the chaser by its own sensors and returns the scenario with the result as odometry; see navigated().
/// `line` starts the progress line. Throws Stopped on an interrupt or after `time_limit` [s], since solvers cannot be
/// compared on an unfinished problem.
Scenario navigate_first(Scenario scenario, NavigationOptions options, const Output& output, const std::string& line,
                        double time_limit);

}  // namespace tandem
