#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/navigation/navigated.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/implausible_times.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

const char* const kSensors = "Sensors";

/// Sensors as the options say; options about a target need one, those about the chaser's own sensors need these.
void apply_options(const ProblemRequest& request, const CommandOptions& option, bool own, Scenario& scenario) {
  const bool target = !scenario.data.sensors.empty();
  if (const auto names = option.given(kTarget); !target && !names.empty())
    throw Error(
        fmt::format("{} is about a target, and {} has no sensor that sees one", names.front(), request.scenario));
  if (const auto names = option.given(kOwnSensors); !own && !names.empty())
    throw Error(fmt::format("{} is about the chaser's own sensors, and in {} it moves by odometry", names.front(),
                            request.scenario));
  apply(request.sensors, {target, own}, scenario);
  if (own) apply(request.own, *scenario.navigation);
}

}  // namespace

void add_scenario(CommandOptions& option, std::string& scenario, const std::string& help) {
  option.argument("scenario", "SCENARIO", help, scenario);
}

void add_problem(CommandOptions& option, ProblemRequest& request, bool limits) {
  add_scenario(option, request.scenario, "A scenario folder, or the name of a built-in scenario");
  TrackingOptions& target = request.target;
  option.group(kTarget);
  option("--mode", "A|B", "Target as poses (A, default) or poses where one was measured, else points (B)", target.mode,
         parse_mode);
  option("--model", "NAME",
         fmt::format("Motion: {} (default {})", listed(model_names(), "or"), name(MotionModel::constant_twist)),
         target.model, parse_model);
  option("--junction", "boundary|direct", "How mode B ties points to poses (default boundary)", target.junction,
         parse_junction);
  option("--horizons", "LIST",
         "Triples (k-m, k, k+n) of constant or damped motion: m:n or one number for both (default 1)", target.horizons,
         parse_horizons);
  option("--roll-pitch", "soft|hard|off", "The target is level, in mode B too (default soft)", target.roll_pitch,
         parse_role);
  option("--non-holonomic", "soft|hard|off", "The target has no sway, no heave (default off)", request.non_holonomic,
         parse_role);
  option("--surge", "MIN,MAX", "Limits of the target's surge [m/s]; inf is none", target.surge, parse_interval);
  option("--yaw-rate", "MAX", "Limit of the target's yaw rate [rad/s]", target.max_yaw_rate, parse_magnitude);
  if (limits)
    option("--limits", "hard|soft",
           "How surge and yaw rate are held (default hard where the solver takes hard constraints, else soft)",
           request.limits, parse_limits);
  option.group(kSensors);
  option.flag("--robust",
              "For real detections: Cauchy losses at 2 sigmas, a start without turned or far ones; what is 100 sigmas, "
              "or a direction 45 degrees, off is left out",
              [&target] { make_robust(target); });
  add_sensors(option, request.sensors);
}

void add_max_keyframes(CommandOptions& option, ProblemRequest& request) {
  option.group(kSensors);
  option("--max-keyframes", "N", "Take the first N keyframes only", request.target.max_keyframes,
         [](const std::string& name, const std::string& text) {
           return static_cast<std::size_t>(parse_count(name, text));
         });
  add_force(option, request.force);
}

void add_force(CommandOptions& option, bool& force) {
  option.flag(
      "--force",
      "Take a recording with gaps of hours, of more than 200,000 keyframes or whose stamps are not in seconds, too",
      force);
}

void refuse_implausible_times(const Scenario& scenario, const std::string& name, bool force) {
  if (force) return;
  if (const std::string why = implausible_times(scenario); !why.empty())
    throw Error(fmt::format("{}: {} (with --force it is taken all the same)", name, why));
}

TrackingOptions tracking_options(const ProblemRequest& request, bool hard_limits) {
  TrackingOptions options = request.target;
  if (request.limits && !options.surge && !options.max_yaw_rate)
    throw Error("--limits says how --surge and --yaw-rate are held; give one of them too");
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

Scenario read_asked(const std::string& scenario, const Stop& stop) {
  return read_scenario(find_scenario(scenario, builtin_scenarios()), stop.with_grace());
}

Scenario read_problem(const ProblemRequest& request, const CommandOptions& option, const Stop& stop) {
  Scenario scenario = read_asked(request.scenario, stop);
  if (scenario.navigation && scenario.data.sensors.empty())
    throw Error(fmt::format("{} has no sensor that sees a target: for its own trajectory use tandem navigate",
                            request.scenario));
  apply_options(request, option, needs_navigation(scenario), scenario);
  refuse_implausible_times(scenario, request.scenario, request.force);
  return scenario;
}

Scenario read_any_problem(const ProblemRequest& request, const CommandOptions& option, const Stop& stop) {
  Scenario scenario = read_asked(request.scenario, stop);
  apply_options(request, option, !moves_by_odometry(scenario), scenario);
  refuse_implausible_times(scenario, request.scenario, request.force);
  return scenario;
}

Scenario read_problem_settings(const ProblemRequest& request, const CommandOptions& option, RowsIn rows) {
  Scenario scenario = read_settings(find_scenario(request.scenario, builtin_scenarios()), rows);
  apply_options(request, option, !moves_by_odometry(scenario), scenario);
  return scenario;
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
