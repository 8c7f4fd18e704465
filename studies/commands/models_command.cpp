#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/comparison/model_scores.hpp>
#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/comparison/models_report.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

struct ModelsRequest {
  ProblemRequest problem;
  std::vector<NamedByOption> models;  ///< values of --models
  std::optional<AnySolver> solver;
  std::optional<double> time_limit;
  bool full = false;
  Output output;
};

std::vector<NamedModel> requested_models(const ModelsRequest& request, const TrackingOptions& base) {
  std::vector<NamedModel> models;
  for (const auto& [option, list] : request.models)
    for (NamedModel& model : parse_model_list(option, list, base)) models.push_back(std::move(model));
  if (request.models.empty())
    for (const std::string& name : default_models()) models.push_back(parse_model_spec("default", name, base));
  return models;
}

/// Returns why the results are incomplete, or an empty string.
std::string incomplete_reason(const std::vector<ModelResult>& results, std::size_t models) {
  if (interrupted()) return fmt::format("interrupted after {} of {} models", results.size(), models);
  std::vector<std::string> names;
  for (const ModelResult& r : results)
    if (r.solved && r.status != name(Status::converged)) names.push_back(r.name);
  if (names.empty())
    return std::any_of(results.begin(), results.end(), [](const ModelResult& r) { return r.solved; })
               ? ""
               : fmt::format("no model gives a valid problem: {}", results.front().message);
  return fmt::format("{} of {} models did not converge: {}", names.size(), models, fmt::join(names, ", "));
}

/// Runs the command. An interrupt ends it with the models so far.
int run_models(const ModelsRequest& request, const CommandOptions& option) {
  const TrackingOptions base = tracking_options(request.problem, true);
  const std::vector<NamedModel> models = requested_models(request, base);
  Scenario scenario = read_problem(request.problem, option, Stop(&interrupted()));
  if (needs_navigation(scenario))
    scenario = navigate_first(std::move(scenario), navigation_options(request.problem), request.output,
                              "navigation: ", request.time_limit.value_or(HUGE_VAL));
  make_keyframes(scenario.data, base.max_keyframes);  // reports errors that all models would have

  std::vector<ModelResult> results;
  for (const NamedModel& model : models) {
    if (interrupted()) break;
    AnySolver solver = request.solver.value_or(solver_for(model));
    if (request.time_limit) common(solver).time_limit = *request.time_limit;
    const WatchedSolve watched(common(solver), request.output,
                               fmt::format("{}/{} {}: ", results.size() + 1, models.size(), model.name));
    results.push_back(evaluate_model(scenario, model, solver));
  }

  if (!scenario.has_truth()) {
    ProgressLine line;
    const StdoutToStderr redirection;
    score_models(scenario, models, results, Stop(&interrupted(), request.time_limit.value_or(HUGE_VAL)),
                 [&](std::size_t i) {
                   if (request.output.shows_progress())
                     line.show(fmt::format("held-out measurements {}/{} {}", i + 1, results.size(), models[i].name));
                 });
  }

  Results found;
  found.table = [&] { return models_report(scenario.name, results, request.full); };
  found.json = [&] { return models_json(scenario.name, results); };
  found.plots_command = "models";
  found.write = [&](const std::filesystem::path& folder) {
    write_file(folder / "models.csv", models_csv(scenario.name, results));
  };
  found.incomplete_reason = incomplete_reason(results, models.size());
  return finish(request.output, found);
}

}  // namespace

Command models_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<ModelsRequest>();
        option.footer(fmt::format(
            "A model is [MODEL][+CONSTRAINT[:VALUES][:soft|hard]]..., e.g. "
            "constant-twist+non-holonomic:hard+surge:0,2.5:soft or all:hard. {} all stands for the four "
            "constraints before it; horizons:LIST is as --horizons. --surge and --yaw-rate set the limits of models "
            "that give no values.",
            model_spec_words()));
        add_problem(option, request->problem, false);
        add_max_keyframes(option, request->problem);
        add_own_sensors(option, request->problem.own, true);
        option.group("Models and solver");
        option.repeatable("--models", "LIST",
                          "Models, comma-separated, see below (default: all models, and soft and hard constraints)",
                          request->models, parse_name);
        add_solver(option, request->solver, "gauss-newton; augmented-lagrangian with hard constraints");
        option("--time-limit", "SECONDS",
               "Wall-clock time limit of each model (default: none). The navigation before the models and the scores "
               "after "
               "them have the same limit",
               request->time_limit, parse_non_negative);
        add_threads(option);
        add_output(option, request->output,
                   {.writes = "Write models.csv and a plot to DIR", .force = &request->problem.force});
        option.flag("--full", "Print all rows instead of a summary", request->full);
        return [request, &option] { return run_models(*request, option); };
      },
      true,
      [] {
        std::vector<FileDescription> files = models_file_columns();
        files.push_back(models_json_keys());
        return files;
      }};
}

TANDEM_COMMAND(models, "Models and noise", "Compare motion models of the target on a scenario")

}  // namespace tandem
