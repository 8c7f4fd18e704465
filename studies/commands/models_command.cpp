#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/studies/commands/models_command.hpp>
#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/comparison/models_report.hpp>
#include <tandem/studies/navigation/navigated.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/progress_line.hpp>

namespace tandem {
namespace {

std::vector<NamedModel> models_meant(const ModelsArguments& arguments, const TrackingOptions& base) {
  std::vector<NamedModel> models;
  for (const std::string& list : arguments.models)
    for (NamedModel& model : parse_model_list("--models", list, base)) models.push_back(std::move(model));
  if (arguments.models.empty())
    for (const std::string& name : default_models()) models.push_back(parse_model_spec("--models", name, base));
  return models;
}

ModelResult try_with_progress(const Scenario& scenario, const NamedModel& model, Solver solver,
                              const std::string& progress) {
  ProgressLine line(progress);
  std::visit(
      [&](SolverOptions& options) {
        options.stop = &interrupted();
        if (!progress.empty()) options.progress = [&](const Progress& p) { line.show(p); };
      },
      solver);
  const LibrariesPrintToStderr redirection;
  return try_model(scenario, model, solver);
}

}  // namespace

int run_models(const ModelsArguments& arguments) {
  const TrackingOptions base = tracking_options(arguments.tracking);
  const std::vector<NamedModel> models = models_meant(arguments, base);
  std::optional<Solver> solver;
  if (arguments.solver) solver = parse_solver("--solver", *arguments.solver);
  std::optional<double> time_limit;
  if (arguments.time_limit) time_limit = parse_magnitude("--time-limit", *arguments.time_limit);
  std::optional<OutputFolder> out;
  if (arguments.out) out.emplace(*arguments.out);
  Scenario scenario = scenario_with(arguments.tracking);
  if (needs_navigation(scenario)) scenario = navigated(std::move(scenario), {}).scenario;
  make_keyframes(scenario.data, base.max_keyframes);  // throws what would be wrong with every model

  stop_on_interrupt();
  const bool progress = !arguments.quiet && isatty(STDERR_FILENO);
  std::vector<ModelResult> results;
  for (const NamedModel& model : models) {
    if (interrupted()) break;
    Solver chosen = solver ? *solver : solver_for(model);
    if (time_limit) std::visit([&](SolverOptions& options) { options.time_limit = *time_limit; }, chosen);
    results.push_back(try_with_progress(
        scenario, model, chosen,
        progress ? fmt::format("{}/{} {}: ", results.size() + 1, models.size(), model.name) : std::string()));
  }

  if (out)
    out->fill({"models.csv"}, [&](const std::filesystem::path& folder) {
      write_file(folder / "models.csv", models_csv(scenario.name, results));
    });
  if (arguments.json) {
    fmt::print("{}", models_json(scenario.name, results));
  } else if (!arguments.quiet) {
    fmt::print("{}", models_report(scenario.name, results));
    if (out) fmt::print("\nWritten to {}\n", *arguments.out);
  }
  std::fflush(stdout);
  if (interrupted()) fmt::print(stderr, "tandem: interrupted after {} of {} models\n", results.size(), models.size());
  for (const ModelResult& r : results)
    if (r.solved && r.status != name(Status::converged)) return 2;
  return interrupted() ? 2 : 0;
}

}  // namespace tandem
