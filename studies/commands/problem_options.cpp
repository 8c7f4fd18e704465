#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/implausible_times.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Applies the sensor options to the scenario. Throws Error on target options without a target, and on own-sensor
/// options for a chaser that uses odometry (`own` is false).
void apply_options(const ProblemRequest& request, const CommandOptions& option, bool own, Scenario& scenario) {
  const bool target = !scenario.data.sensors.empty();
  if (const auto names = option.given(kTarget); !target && !names.empty())
    throw Error(fmt::format("{} needs a target, but {} has no target sensor", names.front(), request.scenario));
  if (const auto names = option.given(kOwnSensors); !own && !names.empty())
    throw Error(fmt::format("{} needs a chaser that moves by its own sensors, but {} has odometry", names.front(),
                            request.scenario));
  apply(request.sensors, {target, own}, scenario);
  if (own) apply(request.own, *scenario.navigation);
}

/// Returns "A, B or C" of all motion models except the default.
std::string other_models() {
  std::vector<std::string> names = model_names();
  names.erase(names.begin());
  return listed(names, "or");
}

}  // namespace

void add_scenario(CommandOptions& option, std::string& scenario, const std::string& help) {
  option.argument("scenario", "SCENARIO", help, scenario);
}

void add_problem(CommandOptions& option, ProblemRequest& request, bool limits) {
  add_scenario(option, request.scenario, "Scenario folder, or name of a built-in scenario");
  TrackingOptions& target = request.target;
  option.group(kTarget);
  option(
      "--mode", "A|B",
      "Target states: poses (A, default), or points where no pose is measured (B). In Mode B the target is a pose at "
      "keyframes "
      "with a measured pose, otherwise a point",
      target.mode, parse_mode);
  option("--model", "NAME", fmt::format("Motion model: {} (default), {}", model_names().front(), other_models()),
         target.model, parse_model);
  option("--non-holonomic", "soft|hard|off", "No sway and no heave: role of the constraint (default off)",
         request.non_holonomic, parse_role);
  option("--roll-pitch", "soft|hard|off", "Level target: role of the roll-pitch prior (default soft)",
         target.roll_pitch, parse_role);
  option("--surge", "MIN,MAX", "Limits of the surge [m/s]; inf for no limit (default: no limits)", target.surge,
         parse_interval);
  option("--yaw-rate", "MAX", "Limit of the magnitude of the yaw rate [rad/s] (default: no limit)", target.max_yaw_rate,
         parse_non_negative);
  option.advanced();
  if (limits)
    option("--limits", "hard|soft",
           "Role of --surge and --yaw-rate (default: hard if the solver supports hard constraints, else soft)",
           request.limits, parse_limits);
  option("--junction", "boundary|direct",
         "Mode B: join points and poses by boundary residuals, or let velocity residuals read the poses directly "
         "(default boundary)",
         target.junction, parse_junction);
  option("--horizons", "LIST",
         "Keyframe triples (k-m, k, k+n) of the motion model, comma-separated: m:n, or one number for both (default 1)",
         target.horizons, parse_horizons);
  option.group(kSensors);
  option.flag("--robust",
              "Robust losses and outlier rejection, for real detections. Cauchy losses of scale 2, an initial guess "
              "without outliers, and rejection of measurements that are 100 standard deviations (directions: 45 "
              "degrees) off",
              [&target] { make_robust(target); });
  add_sensors(option, request.sensors);
}

void add_max_keyframes(CommandOptions& option, ProblemRequest& request) {
  option.group(kSensors);
  option.advanced();
  option("--max-keyframes", "N", "Use only the first N keyframes (default: all)", request.target.max_keyframes,
         [](const std::string& name, const std::string& text) {
           return static_cast<std::size_t>(parse_count(name, text));
         });
  add_force(option, request.force);
}

void add_force(CommandOptions& option, bool& force) {
  option.group(kSensors);
  option.advanced();
  option.flag("--force",
              "Accept implausible times (gaps of more than an hour, more than 200,000 keyframes, times that are not in "
              "seconds), "
              "and overwrite files in --out that tandem did not write",
              force);
}

void reject_implausible_times(const Scenario& scenario, const std::string& name, bool force) {
  if (force) return;
  if (const std::string why = implausible_times(scenario); !why.empty())
    throw Error(fmt::format("{}: {}; use --force to accept the recording", name, why));
}

TrackingOptions tracking_options(const ProblemRequest& request, bool hard_limits) {
  TrackingOptions options = request.target;
  if (request.limits && !options.surge && !options.max_yaw_rate) throw Error("--limits needs --surge or --yaw-rate");
  options.limits = request.limits.value_or(hard_limits ? Role::hard : Role::soft);
  options.non_holonomic = request.non_holonomic.value_or(Role::off);
  if (const auto loss = request.sensors.loss()) options.loss = *loss;
  if (const auto loss = request.sensors.orientation_loss()) options.orientation_loss = loss;
  return options;
}

NavigationOptions navigation_options(const ProblemRequest& request) {
  NavigationOptions options = request.own.navigation;
  options.ego.loss = request.sensors.loss().value_or(request.target.loss);
  return options;
}

Scenario read_requested_scenario(const std::string& scenario, const Stop& stop) {
  return read_scenario(find_scenario(scenario, builtin_scenarios()), stop.with_grace());
}

Scenario read_problem(const ProblemRequest& request, const CommandOptions& option, const Stop& stop) {
  Scenario scenario = read_requested_scenario(request.scenario, stop);
  if (scenario.navigation && scenario.data.sensors.empty())
    throw Error(fmt::format("{} has no target sensor; for the trajectory of the chaser alone, use tandem navigate",
                            request.scenario));
  apply_options(request, option, needs_navigation(scenario), scenario);
  reject_implausible_times(scenario, request.scenario, request.force);
  return scenario;
}

Scenario read_any_problem(const ProblemRequest& request, const CommandOptions& option, const Stop& stop) {
  Scenario scenario = read_requested_scenario(request.scenario, stop);
  apply_options(request, option, !moves_by_odometry(scenario), scenario);
  reject_implausible_times(scenario, request.scenario, request.force);
  return scenario;
}

Scenario read_problem_settings(const ProblemRequest& request, const CommandOptions& option, RowsIn rows) {
  Scenario scenario = read_settings(find_scenario(request.scenario, builtin_scenarios()), rows);
  apply_options(request, option, !moves_by_odometry(scenario), scenario);
  return scenario;
}

ProblemOfWords apply_words(const std::vector<std::string>& words, Scenario scenario) {
  CLI::App app;
  CommandOptions option(app);
  ProblemRequest request;
  add_problem(option, request, true);
  add_hold_out(option, request.sensors);
  add_max_keyframes(option, request);
  add_own_sensors(option, request.own, true);
  std::vector<std::string> reversed(words.rbegin(), words.rend());  // as CLI11 takes them
  reversed.insert(reversed.begin(), scenario.folder.string());
  try {
    app.parse(std::move(reversed));
  } catch (const CLI::ParseError& error) {
    throw BadInputError(error.what());
  }
  option.read(words);
  apply_options(request, option, !moves_by_odometry(scenario), scenario);
  return {std::move(scenario), tracking_options(request, false), navigation_options(request)};
}

Scenario navigate_first(Scenario scenario, NavigationOptions options, const Output& output, const std::string& line,
                        double time_limit) {
  options.solver.time_limit = time_limit;
  const WatchedSolve watched(options.solver, output, line);
  const Stop stop(options.solver);
  Scenario with_chaser = navigated(std::move(scenario), options).scenario;
  stop.check("navigation");
  return with_chaser;
}

}  // namespace tandem
