#include <set>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/navigation/more/navigation_files.hpp>
#include <tandem/studies/navigation/more/navigation_report.hpp>
#include <tandem/studies/scenario/scenario_ego.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct NavigateRequest {
  std::string scenario;
  SensorOptions sensors;
  std::vector<NamedByOption> fit_delay;
  std::optional<double> keyframe_interval, after;
  OwnSensorOptions own;
  bool force = false;
  std::function<void(const Problem&)> built;
  Output output;
};

double parse_keyframe_interval(const std::string& option, const std::string& text) {
  const double seconds = parse_magnitude(option, text);
  if (seconds <= kSameInstant)
    throw Error(fmt::format("{} is in seconds and above 0.001, not {}", option, quote(text)));
  return seconds;
}

Scenario read_navigation(const NavigateRequest& request, const Stop& stop) {
  Scenario scenario = read_asked(request.scenario, stop);
  if (!scenario.navigation)
    throw Error(
        fmt::format("{} has no sensor of the chaser's own: sensors in scenario.yaml of the types {}; for chaser "
                    "and target by odometry use tandem estimate",
                    request.scenario, listed(ego_types(), "or")));
  if (request.keyframe_interval) scenario.navigation->keyframe_interval = *request.keyframe_interval;
  return scenario;
}

int run_navigate(const NavigateRequest& request) {
  // The study has all sensors: what the truth is of can depend on one that the navigation does without.
  NavigationOptions options = request.own.navigation;
  options.solver.stop = &interrupted();
  const Stop stop(options.solver);
  NavigationStudy study;
  study.scenario = read_navigation(request, stop);
  SensorOptions all = request.sensors;
  all.without.clear();
  apply(all, {.target = false, .own = true}, study.scenario);
  Scenario in_use = study.scenario;
  in_use.data = TrackingData();  // of a target, which says nothing of this
  apply({.without = request.sensors.without}, {.target = false, .own = true}, in_use);
  NavigationData& data = *in_use.navigation;
  apply(request.own, data);
  refuse_implausible_times(in_use, request.scenario, request.force);
  std::set<std::string> fitted;
  for (const NamedByOption& sensor : request.fit_delay) {
    check_delayed(data, sensor);
    if (!fitted.insert(sensor.name).second) throw Error("--fit-delay " + sensor.name + " is given twice");
  }

  if (const auto loss = request.sensors.loss()) options.ego.loss = *loss;
  study.options = options.ego;
  study.after = request.after;
  for (const NamedByOption& sensor : request.fit_delay) {  // one after the other, each with those before
    stop.limit(options.solver);
    study.delays.push_back(fit_delay(data, sensor.name, options));
    set_delay(data, sensor.name, study.delays.back().delay);
  }
  {
    stop.limit(options.solver);
    options.built = request.built;  // not of what finds the delays
    const WatchedSolve watched(options.solver, request.output);
    study.navigation = navigate(data, options);
  }
  study.comparison = compare_with_truth(study.navigation, study.scenario);

  Results results;
  results.table = [&] { return navigation_report(study); };
  results.json = [&] { return navigation_json(study); };
  results.plots_of = "navigate";
  results.write = [&](const std::filesystem::path& folder) { write_navigation(study, folder); };
  results.not_done =
      study.navigation.cut_short ? study.navigation.why_no_covariance : why_not_converged(study.navigation.summary);
  return finish(request.output, results);
}

}  // namespace

Command navigate_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<NavigateRequest>();
            option.footer("Exit status: 0 converged, 1 wrong input or usage, 2 not converged or cut short.");
            add_scenario(option, request->scenario, "A scenario folder with an imu, dvl, depth, gps, heading");
            add_sensors(option, request->sensors);
            option.repeatable(
                "--fit-delay", "SENSOR",
                "Find the delay that makes the data likeliest, first: up to 1 s; of an imu within 0.1 s of the others",
                request->fit_delay, parse_name);
            option("--keyframe-interval", "SECONDS", "In place of the scenario's", request->keyframe_interval,
                   parse_keyframe_interval);
            add_force(option, request->force);
            add_own_sensors(option, request->own, true);
            option.group("Solver");
            add_stops(option, [request]() -> SolverOptions& { return request->own.navigation.solver; });
            add_threads(option);
            option.flag("--no-covariance", "No covariances, to save their time",
                        [request] { request->own.navigation.covariance = false; });
            add_write_problem(option, request->built);
            add_output(option, request->output, {.writes = "Write trajectory, errors, summary.json and plots to DIR"});
            option("--after", "SECONDS", "Summarise the errors after the first so many seconds, too", request->after,
                   parse_magnitude);
            return [request] { return run_navigate(*request); };
          },
          true};
}

}  // namespace tandem
