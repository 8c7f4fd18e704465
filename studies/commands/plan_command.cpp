#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/planning_options.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/planning/plan_files.hpp>
#include <tandem/studies/planning/plan_report.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {
namespace {

struct PlanCommandRequest {
  ProblemRequest problem;
  PlanningArguments planning;
  double at = 0.0;
  Output output;
};

int run_plan(const PlanCommandRequest& request, const CommandOptions& option) {
  const TrackingOptions options = tracking_options(request.problem, false);
  const Scenario scenario = read_problem(request.problem, option, Stop(&interrupted()));
  const Vehicle vehicle = read_vehicle(request.planning.vehicle);
  PlanRequest plan = plan_request(request.planning, vehicle, scenario.frame);
  plan.at = request.at;
  const PlannedRun run = plan_scenario(scenario, options, vehicle, plan);

  Results results;
  results.table = [&] { return report(run); };
  results.json = [&] { return plan_json(run); };
  results.plots_command = "plan";
  results.write = [&](const std::filesystem::path& folder) { write_plan(run, folder); };
  results.incomplete_reason = why_not_accepted(run);
  return finish(request.output, results);
}

}  // namespace

Command plan_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<PlanCommandRequest>();
            option.exit_status(
                "Exit status: 0 plan found, 1 invalid input or usage, 2 no plan satisfies all hard constraints.");
            add_problem(option, request->problem, false);
            add_force(option, request->problem.force);
            option.group("Plan");
            option.required("--at", "T", "Time of the plan [s]: estimate from the data until T, then plan", request->at,
                            parse_finite);
            add_planning_options(option, request->planning);
            add_threads(option);
            add_output(
                option, request->output,
                {.writes = "Write the plan, the predicted target, the commands and the active constraints to DIR",
                 .force = &request->problem.force});
            return [request, &option] { return run_plan(*request, option); };
          },
          false,
          [] {
            std::vector<FileDescription> files = plan_file_columns({"NAME"});
            files.push_back(plan_json_keys());
            return files;
          }};
}

TANDEM_COMMAND(plan, "Planning", "Plan the chaser's motion relative to the predicted target")

}  // namespace tandem
