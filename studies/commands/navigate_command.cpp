#include <set>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/navigation/likely_own_causes.hpp>
#include <tandem/studies/navigation_results/navigation_files.hpp>
#include <tandem/studies/navigation_results/navigation_report.hpp>
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
  const double seconds = parse_non_negative(option, text);
  if (seconds <= kSameInstant) throw Error(fmt::format("{} takes seconds above 0.001, not {}", option, quote(text)));
  return seconds;
}

Scenario read_navigation(const NavigateRequest& request, const Stop& stop) {
  Scenario scenario = read_requested_scenario(request.scenario, stop);
  if (!scenario.navigation)
    throw Error(fmt::format(
        "{} has none of the chaser's own sensors (type {} in scenario.yaml); use tandem estimate for a chaser "
        "with odometry",
        request.scenario, listed(ego_types(), "or")));
  if (request.keyframe_interval) scenario.navigation->keyframe_interval = *request.keyframe_interval;
  return scenario;
}

int run_navigate(const NavigateRequest& request) {
  // The study keeps the sensors that --without removes: the comparison with the truth may need the mounting of one.
  NavigationOptions options = request.own.navigation;
  options.solver.stop = &interrupted();
  const Stop stop(options.solver);
  NavigationStudy study;
  study.scenario = read_navigation(request, stop);
  options.north_east = study.scenario.frame.is_ned();
  SensorOptions all = request.sensors;
  all.without.clear();
  apply(all, {.target = false, .own = true}, study.scenario);
  Scenario in_use = study.scenario;
  in_use.data = TrackingData();  // target measurements do not affect the navigation
  apply({.without = request.sensors.without}, {.target = false, .own = true}, in_use);
  NavigationData& data = *in_use.navigation;
  apply(request.own, data);
  reject_implausible_times(in_use, request.scenario, request.force);
  std::set<std::string> fitted;
  for (const NamedByOption& sensor : request.fit_delay) {
    check_delay_is_fixed(data, sensor);
    if (!fitted.insert(sensor.name).second) throw Error("--fit-delay " + sensor.name + " is given twice");
  }

  if (const auto loss = request.sensors.loss()) options.ego.loss = *loss;
  study.options = options.ego;
  study.after = request.after;
  for (const NamedByOption& sensor : request.fit_delay) {  // each fit uses the delays fitted before
    stop.limit(options.solver);
    study.delays.push_back(fit_delay(data, sensor.name, options, progress_shown(request.output)));
    set_delay(data, sensor.name, study.delays.back().delay);
  }
  {
    stop.limit(options.solver);
    options.built = request.built;  // set only now: the fits above are not written
    const WatchedSolve watched(options.solver, request.output);
    study.navigation = navigate(data, options);
  }
  stop.limit(options.solver);
  study.causes = likely_own_causes(data, options, study.navigation, study.scenario.frame);
  study.comparison = compare_with_truth(study.navigation, study.scenario);

  Results results;
  results.table = [&] { return navigation_report(study); };
  results.json = [&] { return navigation_json(study); };
  results.plots_command = "navigate";
  results.write = [&](const std::filesystem::path& folder) { write_navigation(study, folder); };
  results.incomplete_reason =
      study.navigation.cut_short ? study.navigation.why_no_covariance : why_not_converged(study.navigation.summary);
  if (!study.navigation.fit.consistent()) results.misfit = study.navigation.fit.verdict();
  return finish(request.output, results);
}

}  // namespace

Command navigate_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<NavigateRequest>();
        add_scenario(option, request->scenario,
                     "Scenario folder with at least one imu, dvl, depth, gps or heading sensor");
        add_sensors(option, request->sensors);
        option.everyday();
        option.repeatable(
            "--fit-delay", "SENSOR",
            "First estimate the delay of SENSOR by maximum likelihood. The range is 0 to 1 s, for an imu -0.1 to 0.1 s",
            request->fit_delay, parse_name);
        option("--keyframe-interval", "SECONDS",
               "Time between keyframes [s] (default: keyframe_interval of the scenario)", request->keyframe_interval,
               parse_keyframe_interval);
        add_force(option, request->force);
        add_own_sensors(option, request->own, true, true);
        option.group("Solver");
        add_stop_criteria(option, [request]() -> SolverOptions& { return request->own.navigation.solver; });
        add_threads(option);
        option.advanced();
        option.flag("--no-covariance", "Skip the computation of covariances",
                    [request] { request->own.navigation.covariance = false; });
        add_write_problem(option, request->built);
        add_output(option, request->output,
                   {.writes = "Write trajectory, errors, summary.json and plots to DIR",
                    .judges = true,
                    .force = &request->force});
        add_at(option, request->own.navigation.at, request->output);
        option("--after", "SECONDS",
               "Also summarise the errors after the first SECONDS of data [s] (default: only of all data)",
               request->after, parse_non_negative);
        return [request] { return run_navigate(*request); };
      },
      true,
      [] {
        std::vector<FileDescription> files = navigation_file_columns();
        files.push_back(navigation_json_keys());
        return files;
      }};
}

TANDEM_COMMAND(navigate, "Estimation", "Estimate the chaser's trajectory from its own sensors")

}  // namespace tandem
