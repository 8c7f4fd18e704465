#include <fmt/format.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/comparison/models_report.hpp>
#include <tandem/studies/navigation/navigated.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

struct ModelsRequest {
  ProblemRequest problem;
  std::vector<NamedByOption> models;  ///< lists
  std::optional<Solver> solver;
  std::optional<double> time_limit;
  Output output;
};

std::vector<NamedModel> models_meant(const ModelsRequest& request, const TrackingOptions& base) {
  std::vector<NamedModel> models;
  for (const auto& [option, list] : request.models)
    for (NamedModel& model : parse_model_list(option, list, base)) models.push_back(std::move(model));
  if (request.models.empty())
    for (const std::string& name : default_models()) models.push_back(parse_model_spec("default", name, base));
  return models;
}

/// Why the exit status is not 0, if it is not.
std::string what_is_missing(const std::vector<ModelResult>& results, std::size_t models) {
  if (interrupted()) return fmt::format("interrupted after {} of {} models", results.size(), models);
  std::vector<std::string> names;
  for (const ModelResult& r : results)
    if (r.solved && r.status != name(Status::converged)) names.push_back(r.name);
  if (names.empty()) return "";
  return fmt::format("{} of {} models did not converge: {}", names.size(), models, fmt::join(names, ", "));
}

/// An interrupt ends it with the models that are there.
int run_models(const ModelsRequest& request, const CommandOptions& option) {
  const TrackingOptions base = tracking_options(request.problem, true);
  const std::vector<NamedModel> models = models_meant(request, base);
  Scenario scenario = read_problem(request.problem, option, Stop(&interrupted()));
  if (needs_navigation(scenario))
    scenario = navigate_first(std::move(scenario), navigation_options(request.problem), request.output,
                              "navigation: ", request.time_limit.value_or(HUGE_VAL));
  make_keyframes(scenario.data, base.max_keyframes);  // throws what would be wrong with every model

  std::vector<ModelResult> results;
  for (const NamedModel& model : models) {
    if (interrupted()) break;
    Solver solver = request.solver.value_or(solver_for(model));
    if (request.time_limit) common(solver).time_limit = *request.time_limit;
    const WatchedSolve watched(common(solver), request.output,
                               fmt::format("{}/{} {}: ", results.size() + 1, models.size(), model.name));
    results.push_back(try_model(scenario, model, solver));
  }

  Results found;
  found.table = [&] { return models_report(scenario.name, results); };
  found.json = [&] { return models_json(scenario.name, results); };
  found.plots_of = "models";
  found.write = [&](const std::filesystem::path& folder) {
    write_file(folder / "models.csv", models_csv(scenario.name, results));
  };
  found.not_done = what_is_missing(results, models.size());
  return finish(request.output, found);
}

}  // namespace

Command models_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<ModelsRequest>();
            option.footer(fmt::format(
                "A model is [MODEL][+CONSTRAINT[:VALUES][:soft|hard]]…, e.g. "
                "constant-twist+non-holonomic:hard+surge:0,2.5:soft or all:hard. {} --surge and --yaw-rate give the "
                "limits of models that name none.\nExit status: 0 converged, 1 wrong input or usage, 2 some model did "
                "not converge or interrupted.",
                model_spec_words()));
            add_problem(option, request->problem, false);
            add_max_keyframes(option, request->problem);
            add_own_sensors(option, request->problem.own, true);
            option.group("Models and solver");
            option.repeatable("--models", "LIST", "Models by commas, see below (default: all, soft and hard)",
                              request->models, parse_name);
            add_solver(option, request->solver, "gauss-newton, augmented-lagrangian for hard constraints");
            option("--time-limit", "SECONDS", "Stop each model after so long, and what is navigated first",
                   request->time_limit, parse_magnitude);
            add_threads(option);
            add_output(option, request->output, {.writes = "Write models.csv and a plot to DIR"});
            return [request, &option] { return run_models(*request, option); };
          },
          true};
}

}  // namespace tandem
