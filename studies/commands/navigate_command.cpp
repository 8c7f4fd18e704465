#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/studies/commands/navigate_command.hpp>
#include <tandem/studies/navigation/navigation_files.hpp>
#include <tandem/studies/navigation/navigation_plots.hpp>
#include <tandem/studies/navigation/navigation_report.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/progress_line.hpp>

namespace tandem {
namespace {

NavigationOptions options_of(const NavigateArguments& arguments) {
  NavigationOptions options = navigation_options(arguments.navigation);
  if (arguments.max_iterations)
    options.solver.max_iterations = parse_count("--max-iterations", *arguments.max_iterations);
  if (arguments.time_limit) options.solver.time_limit = parse_magnitude("--time-limit", *arguments.time_limit);
  options.solver.stop = &interrupted();
  return options;
}

Navigation navigate_with_progress(const NavigationData& data, NavigationOptions options, bool quiet) {
  ProgressLine line;
  if (!quiet && isatty(STDERR_FILENO)) options.solver.progress = [&](const Progress& progress) { line.show(progress); };
  const LibrariesPrintToStderr redirection;
  return navigate(data, options);
}

/// Returns a note about plots that are missing, or nothing.
std::string write_everything(const NavigationStudy& study, const OutputFolder& out, std::optional<PlotFormat> plots) {
  std::string note;
  out.fill({"chaser.tum", "chaser_full.csv", "errors.csv", "weights.csv", "summary.json", "navigation.svg",
            "errors.svg", "navigation.png", "errors.png"},
           [&](const std::filesystem::path& folder) {
             write_navigation(study, folder);
             if (plots) note = draw_navigation(study, *plots, folder);
           });
  return note;
}

}  // namespace

int run_navigate(const NavigateArguments& arguments) {
  const NavigationOptions options = options_of(arguments);
  const auto plots = parse_plots("--plots", arguments.plots.value_or("svg"));
  std::optional<double> after;
  if (arguments.after) after = parse_magnitude("--after", *arguments.after);
  std::optional<OutputFolder> out;
  if (arguments.out) out.emplace(*arguments.out);
  const Scenario scenario = scenario_to_navigate(arguments.navigation);
  NavigationData data = sensors_in_use(scenario, arguments.navigation);
  const std::vector<std::size_t> unknown_delays = delays_to_fit(data, arguments.navigation);

  stop_on_interrupt();
  std::vector<DelayFit> delays;
  for (const std::size_t sensor : unknown_delays) {  // one after the other, each with those before
    delays.push_back(fit_delay(data, sensor, options));
    data.sensors[sensor].delay = delays.back().delay;
  }
  NavigationStudy study;
  study.scenario = scenario;
  study.options = options.ego;
  study.navigation = navigate_with_progress(data, options, arguments.quiet);
  study.delays = delays;
  study.after = after;
  study.comparison = compare_with_truth(study.navigation, scenario);

  std::string note;
  if (out) note = write_everything(study, *out, plots);
  if (arguments.json) {
    fmt::print("{}", navigation_json(study));
  } else if (!arguments.quiet) {
    fmt::print("{}", navigation_report(study));
    if (out) fmt::print("\nWritten to {}\n", *arguments.out);
  }
  std::fflush(stdout);
  if (!note.empty() && !arguments.quiet) fmt::print(stderr, "tandem: {}\n", note);
  const Summary& summary = study.navigation.summary;
  if (summary.converged()) return 0;
  fmt::print(stderr, "tandem: {} did not converge ({}): {}\n", summary.solver, name(summary.status), summary.message);
  return 2;
}

}  // namespace tandem
