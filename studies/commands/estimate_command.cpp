#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/run_file.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/commands/tuning_options.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/estimation/fit_target_delay.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/tuning/model_settings.hpp>
#include <tandem/studies/tuning/tune_report.hpp>
#include <tandem/version.hpp>

namespace tandem {
namespace {

const char* const kSolver = "Solver";

struct EstimateRequest {
  ProblemRequest problem;
  AnySolver solver;
  bool graduated = false, no_covariance = false, tuned = false;
  std::vector<NamedByOption> fit_delay;
  std::function<void(const Problem&)> built;
  std::vector<double> at;  // s
  Output output;
};

/// Returns the requested solver. Without --solver, hard constraints select the augmented Lagrangian, since Gauss-Newton
/// does not support them.
AnySolver solver_of(const EstimateRequest& request, const CommandOptions& option) {
  const std::vector<std::string> given = option.given(kSolver);
  const bool hard = request.problem.non_holonomic == Role::hard || request.problem.limits == Role::hard ||
                    request.problem.target.roll_pitch == Role::hard;
  if (!hard || std::find(given.begin(), given.end(), "--solver") != given.end()) return request.solver;
  AugmentedLagrangianOptions solver;
  static_cast<SolverOptions&>(solver) = common(request.solver);
  return solver;
}

/// Returns why the estimate is incomplete, with the worst suspected outlier as a possible cause.
std::string incomplete_reason(const Estimate& result) {
  std::string why = why_not_converged(result.summary);
  if (why.empty()) why = result.cut_short;
  if (!why.empty() && !result.suspects.empty()) why += "; " + result.suspects.front().text();
  return why;
}

/// Fits the requested delays one after the other, each with those fitted before, and sets them in the scenario.
std::vector<DelayFit> fit_delays(const EstimateRequest& request, const TrackingOptions& options,
                                 const AnySolver& solver, Scenario& scenario) {
  std::vector<DelayFit> fits;
  if (request.fit_delay.empty()) return fits;
  AnySolver limited = solver;
  const Stop stop(common(solver));
  if (needs_navigation(scenario)) {
    NavigationOptions navigation = navigation_options(request.problem);
    stop.limit(navigation.solver);
    NavigatedScenario with_chaser = navigated(std::move(scenario), navigation);
    scenario = std::move(with_chaser.scenario);
    scenario.findings.insert(scenario.findings.end(), with_chaser.findings.begin(), with_chaser.findings.end());
  }
  for (const NamedByOption& sensor : request.fit_delay) {
    if (std::any_of(fits.begin(), fits.end(), [&](const DelayFit& fit) { return fit.sensor == sensor.name; }))
      throw Error("--fit-delay " + sensor.name + " is given twice");
    for (const TargetSensor& s : scenario.data.sensors)
      if (s.name == sensor.name && s.error && s.error->delay_sigma > 0)
        throw Error("--fit-delay " + sensor.name + ": its delay is a systematic error already; remove one of the two");
    stop.limit(common(limited));
    fits.push_back(fit_target_delay(scenario.data, sensor.name, options, limited, request.graduated,
                                    progress_shown(request.output)));
    for (TargetSensor& s : scenario.data.sensors)
      if (s.name == sensor.name) s.delay = fits.back().delay;
  }
  const double first = scenario.data.odometry.front().t;
  for (TargetSensor& s : scenario.data.sensors)  // a fitted delay must not shift them out of the chaser's motion
    std::erase_if(s.measurements, [&](const Measurement& m) { return s.valid_at(m) < first; });
  return fits;
}

/// Replaces the scenario and the options by those of the model that tune() selects, and returns that model in words. A
/// third of the time limit is left for the estimate.
std::string tune_first(const EstimateRequest& request, const CommandOptions& option, Scenario& scenario,
                       TrackingOptions& target, NavigationOptions& own) {
  TuneOptions options = tune_options(option);
  const double most = 2.0 / 3 * common(request.solver).time_limit;
  options.stop = Stop(&interrupted(), std::min(default_tuning_time({&scenario, 1}), most));
  const Scenario given = read_requested_scenario(request.problem.scenario, options.stop);
  if (const auto show = progress_shown(request.output))
    options.progress = [show](const std::string& what) { show("tune: " + what); };
  const StdoutToStderr redirection;
  const Tuning found = tune({given}, options);
  TunedProblem tuned = tuned_problem(found, given);
  scenario = std::move(tuned.scenario);
  target = tuned.target;
  own = tuned.own;
  auto tuned_options = option_values(found.selection.settings);
  for (const auto& [key, values] : option_values(options.start))
    tuned_options.try_emplace(key);  // removed by the search
  tuned_options.try_emplace("tuned");
  set_run_file(run_file("estimate", TANDEM_VERSION, option, tuned_options));
  return tuned_model(found);
}

/// Runs the command. An interrupt ends the solve at its best point.
int run_estimate(const EstimateRequest& request, const CommandOptions& option) {
  AnySolver solver = solver_of(request, option);
  TrackingOptions options = tracking_options(request.problem, supports_hard_limits(solver));
  NavigationOptions navigation = navigation_options(request.problem);
  if (request.no_covariance && !request.problem.sensors.hold_out.empty())
    throw Error("--hold-out needs covariances; remove --no-covariance");
  common(solver).stop = &interrupted();
  const Stop stop(common(solver));
  Scenario scenario = read_problem(request.problem, option, stop);
  const std::string tuned = request.tuned ? tune_first(request, option, scenario, options, navigation) : "";
  stop.limit(common(solver));
  std::vector<DelayFit> delays = fit_delays(request, options, solver, scenario);
  stop.limit(common(solver));
  Estimate result = [&] {
    const WatchedSolve watched(common(solver), request.output);
    return estimate(scenario, options, solver, request.graduated, navigation, !request.no_covariance, request.built,
                    request.at);
  }();
  result.delays = std::move(delays);

  Results results;
  results.table = [&] { return tuned.empty() ? report(result) : tuned + "\n\n" + report(result); };
  results.json = [&] { return summary_json(result); };
  results.plots_command = "estimate";
  results.write = [&](const std::filesystem::path& folder) { write_results(result, scenario, folder); };
  results.incomplete_reason = incomplete_reason(result);
  if (!result.fit.consistent()) results.misfit = result.fit.verdict();
  return finish(request.output, results);
}

}  // namespace

Command estimate_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<EstimateRequest>();
            add_problem(option, request->problem, true);
            add_hold_out(option, request->problem.sensors);
            add_max_keyframes(option, request->problem);
            add_own_sensors(option, request->problem.own, true);
            option.group(kSolver);
            option.flag("--tuned", "Use the model that tandem tune finds from these options", request->tuned);
            add_solver(option, request->solver, "gauss-newton; augmented-lagrangian with hard constraints");
            add_stop_criteria(option, [request]() -> SolverOptions& { return common(request->solver); });
            add_threads(option);
            option.advanced();
            option.repeatable(
                "--fit-delay", "SENSOR",
                "First estimate the delay of SENSOR, which observes the target, by maximum likelihood. The "
                "range is 0 to 3.2 s",
                request->fit_delay, parse_name);
            option.flag("--graduated",
                        "Solve by graduated non-convexity: start with least squares and narrow the robust losses to "
                        "their scale",
                        request->graduated);
            add_ipopt(option, request->solver);
            option.flag("--no-covariance", "Skip the computation of covariances", request->no_covariance);
            add_write_problem(option, request->built);
            add_output(option, request->output,
                       {.writes = "Write trajectories, errors, summary.json and plots to DIR",
                        .judges = true,
                        .force = &request->problem.force});
            add_at(option, request->at, request->output);
            return [request, &option] { return run_estimate(*request, option); };
          },
          true,
          [] {
            std::vector<FileDescription> files = estimate_file_columns();
            files.push_back(summary_json_keys());
            return files;
          }};
}

TANDEM_COMMAND(estimate, "Estimation", "Estimate the trajectories of chaser and target from a recording")

}  // namespace tandem
