#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/estimate_command.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/estimation/estimate_plots.hpp>
#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/progress_line.hpp>

namespace tandem {
namespace {

Solver solver_with_options(const EstimateArguments& arguments) {
  Solver solver = parse_solver("--solver", arguments.solver.value_or("gauss-newton"));
  if (auto* ipopt = std::get_if<IpoptOptions>(&solver)) {
    if (arguments.hessian) ipopt->hessian = parse_hessian("--hessian", *arguments.hessian);
    for (const std::string& assignment : arguments.ipopt) {
      const auto [key, value] = parse_assignment("--ipopt", assignment);
      ipopt->options[key] = value;
    }
  } else if (arguments.hessian || !arguments.ipopt.empty()) {
    throw Error(fmt::format("{} needs --solver ipopt", arguments.hessian ? "--hessian" : "--ipopt"));
  }
  std::visit(
      [&](SolverOptions& options) {
        if (arguments.max_iterations)
          options.max_iterations = parse_count("--max-iterations", *arguments.max_iterations);
        if (arguments.time_limit) options.time_limit = parse_magnitude("--time-limit", *arguments.time_limit);
        options.stop = &interrupted();
      },
      solver);
  return solver;
}

Estimate estimate_with_progress(const Scenario& scenario, const TrackingOptions& options, Solver solver, bool graduated,
                                bool quiet) {
  ProgressLine line;
  if (!quiet && isatty(STDERR_FILENO))
    std::visit([&](SolverOptions& o) { o.progress = [&](const Progress& progress) { line.show(progress); }; }, solver);
  const LibrariesPrintToStderr redirection;
  return estimate(scenario, options, solver, graduated);
}

/// Returns a note about plots that are missing, or nothing.
std::string write_everything(const Estimate& estimate, const Scenario& scenario, const OutputFolder& out,
                             std::optional<PlotFormat> plots) {
  std::string note;
  out.fill({"chaser.tum", "target.tum", "chaser_full.csv", "target_full.csv", "errors.csv", "weights.csv",
            "held_out.csv", "summary.json", "trajectories.svg", "errors.svg", "error_norms.svg", "trajectories.png",
            "errors.png", "error_norms.png"},
           [&](const std::filesystem::path& folder) {
             write_results(estimate, folder);
             if (plots) note = draw_plots(estimate, scenario, *plots, folder);
           });
  return note;
}

}  // namespace

int run_estimate(const EstimateArguments& arguments) {
  const TrackingOptions options = tracking_options(arguments.tracking);
  const Solver solver = solver_with_options(arguments);
  const auto plots = parse_plots("--plots", arguments.plots.value_or("svg"));
  std::optional<OutputFolder> out;
  if (arguments.out) out.emplace(*arguments.out);
  const Scenario scenario = scenario_with(arguments.tracking);

  stop_on_interrupt();
  const Estimate result = estimate_with_progress(scenario, options, solver, arguments.graduated, arguments.quiet);

  std::string note;
  if (out) note = write_everything(result, scenario, *out, plots);
  if (arguments.json) {
    fmt::print("{}", summary_json(result));
  } else if (!arguments.quiet) {
    fmt::print("{}", report(result));
    if (out) fmt::print("\nWritten to {}\n", *arguments.out);
  }
  std::fflush(stdout);
  if (!note.empty() && !arguments.quiet) fmt::print(stderr, "tandem: {}\n", note);
  if (result.summary.converged()) return 0;
  fmt::print(stderr, "tandem: {} did not converge ({}): {}\n", result.summary.solver, name(result.summary.status),
             result.summary.message);
  return 2;
}

}  // namespace tandem
