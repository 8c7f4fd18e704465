#include <cmath>
#include <optional>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/commands/tuning_options.hpp>
#include <tandem/studies/report/tune_page.hpp>
#include <tandem/studies/scenario/noise_file.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/tuning/tune.hpp>
#include <tandem/studies/tuning/tune_report.hpp>

namespace tandem {
namespace {

struct TuneRequest {
  ProblemRequest problem;         ///< for every scenario
  std::vector<std::string> more;  ///< further scenarios
  std::vector<std::string> only, fixed;
  double ahead = 0;
  std::optional<double> time_limit;
  bool dry_run = false, full = false;
  Output output;
};

std::vector<std::string> parse_names(const std::string&, const std::string& text) {
  std::vector<std::string> names;
  for (const std::string_view name : split(text, ',')) names.emplace_back(trimmed(name));
  return names;
}

double parse_time_limit(const std::string& option, const std::string& text) {
  return text == "inf" ? HUGE_VAL : parse_non_negative(option, text);
}

int run_tune(const TuneRequest& request, const CommandOptions& option) {
  TuneOptions options = tune_options(option);
  options.only = request.only;
  options.fixed = request.fixed;
  options.ahead = request.ahead;
  options.dry_run = request.dry_run;
  const Stop reading(&interrupted(), request.time_limit.value_or(HUGE_VAL));
  std::vector<std::string> names = {request.problem.scenario};
  names.insert(names.end(), request.more.begin(), request.more.end());
  std::vector<Scenario> scenarios;
  std::vector<std::string> folders;
  for (const std::string& name : names) {
    scenarios.push_back(read_requested_scenario(name, reading));
    reject_implausible_times(scenarios.back(), name, request.problem.force);
    folders.push_back(std::filesystem::absolute(scenarios.back().folder).lexically_normal().string());
  }
  options.stop = request.time_limit ? reading : Stop(&interrupted(), default_tuning_time(scenarios));
  const Tuning found = [&] {
    ProgressLine line;
    if (request.output.shows_progress()) options.progress = [&](const std::string& what) { line.show(what); };
    const StdoutToStderr redirection;
    return tune(scenarios, options);
  }();

  Results results;
  if (request.dry_run) {
    results.table = [&] { return candidates_report(found); };
    results.json = [&] { return tune_json(found); };
    Output without_files = request.output;
    without_files.folder.reset();
    return finish(without_files, results);
  }
  set_run_file(tuned_run_file(found, folders));
  results.table = [&] { return tune_report(found, request.full); };
  results.json = [&] { return tune_json(found); };
  results.write = [&](const std::filesystem::path& folder) {
    write_file(folder / "summary.json", tune_json(found));
    write_file(folder / "steps.csv", steps_csv(found));
    write_file(folder / "noise.yaml", noise_file_text(found.noise, "Noise of the tuned model. " + tuned_model(found)));
    try {
      write_file(folder / "report.html", tune_page(found));
    } catch (const Error& error) {  // the results are complete without the page
      warn(error.what());
    }
  };
  if (interrupted()) results.incomplete_reason = "interrupted; the result is the best validated model so far";
  return finish(request.output, results);
}

}  // namespace

Command tune_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<TuneRequest>();
        option.footer(
            "Proposes changes of the model from the residuals, and keeps those that predict held-out measurements "
            "better. Truth is not used. Options of the target and the sensors give the model to start from.");
        add_problem(option, request->problem, true);
        add_max_keyframes(option, request->problem);
        add_own_sensors(option, request->problem.own, true);
        option.arguments("scenarios", "SCENARIO", "Further scenarios of the same system, which share the model",
                         request->more);
        option.group("Search");
        option("--time", "SECONDS",
               "Wall-clock time limit, or inf; the result is the best validated model so far (default: 110 with "
               "sensors of the chaser's motion, else 55)",
               request->time_limit, parse_time_limit);
        option("--only", "LIST",
               "Change only these: options (model, error, loss, noise), sensors, or kinds of errors (delay, scale), "
               "comma-separated",
               request->only, parse_names);
        option("--fixed", "LIST", "Do not change these; names as for --only", request->fixed, parse_names);
        option("--ahead", "SECONDS",
               "Also validate predictions this time ahead, from earlier measurements only (default: the longest time "
               "without a position of the target, at most half of the recording, if the held-out blocks are shorter)",
               request->ahead, parse_positive);
        option.flag("--dry-run", "List the candidates and exit", request->dry_run);
        add_threads(option);
        add_output(
            option, request->output,
            {.writes = "Write run.yaml (for --config), noise.yaml (for --noise-from), the steps and a page to DIR",
             .plots = false,
             .force = &request->problem.force});
        option.flag("--full", "Print all candidates instead of a summary", request->full);
        return [request, &option] { return run_tune(*request, option); };
      },
      true,
      [] {
        std::vector<FileDescription> files = tune_file_columns();
        files.push_back(tune_json_keys());
        return files;
      }};
}

TANDEM_COMMAND(tune, "Models and noise", "Find the model of a recording that predicts best, without truth")

}  // namespace tandem
