#include <fmt/format.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/estimation/estimate_report.hpp>

namespace tandem {
namespace {

struct EstimateRequest {
  ProblemRequest problem;
  Solver solver;
  bool graduated = false;
  Output output;
};

/// An interrupt ends the solve at its best point.
int run_estimate(const EstimateRequest& request, const CommandOptions& option) {
  const TrackingOptions options = tracking_options(request.problem, takes_hard_limits(request.solver));
  const Scenario scenario = read_problem(request.problem, option);
  const Estimate result = [&] {
    Solver solver = request.solver;
    const WatchedSolve watched(common(solver), request.output);
    return estimate(scenario, options, solver, request.graduated, navigation_options(request.problem));
  }();

  Results results;
  results.table = [&] { return report(result); };
  results.json = [&] { return summary_json(result); };
  results.plots_of = "estimate";
  results.write = [&](const std::filesystem::path& folder) { write_results(result, scenario, folder); };
  results.not_done = why_not_converged(result.summary);
  return finish(request.output, results);
}

}  // namespace

Command estimate_command() {
  return {"estimate", "Estimate the trajectories of chaser and target of a scenario",
          [](CommandOptions& option) {
            const auto request = std::make_shared<EstimateRequest>();
            option.footer(
                "Exit status: 0 converged, 1 wrong input or usage, 2 not converged (the best estimate is written).");
            add_problem(option, request->problem, true);
            add_hold_out(option, request->problem.sensors);
            add_max_keyframes(option, request->problem);
            add_own_sensors(option, request->problem.own, true);
            option.group("Solver");
            add_solver(option, request->solver);
            option.flag("--graduated",
                        "Graduated non-convexity: robust losses narrow from least squares to their own scale",
                        request->graduated);
            add_ipopt(option, request->solver);
            add_stops(option, [request]() -> SolverOptions& { return common(request->solver); });
            add_output(option, request->output,
                       {.writes = "Write trajectories, errors, summary.json and plots to DIR"});
            return [request, &option] { return run_estimate(*request, option); };
          },
          true};
}

}  // namespace tandem
