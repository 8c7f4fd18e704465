#include <csignal>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/builtin_scenarios.hpp>
#include <tandem/studies/estimate_command.hpp>
#include <tandem/studies/named_noise.hpp>
#include <tandem/studies/option_values.hpp>
#include <tandem/studies/output_folder.hpp>
#include <tandem/studies/progress_line.hpp>
#include <tandem/studies/report.hpp>

namespace tandem {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

/// The next interrupt sets the flag; the one after it ends the program.
void stop_on_interrupt() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigaction(SIGINT, &action, nullptr);
}

TrackingOptions tracking_options(const EstimateArguments& arguments) {
  TrackingOptions options;
  if (arguments.roll_pitch) options.roll_pitch = parse_role("--roll-pitch", *arguments.roll_pitch);
  if (arguments.non_holonomic) options.non_holonomic = parse_role("--non-holonomic", *arguments.non_holonomic);
  if (arguments.surge) options.surge = parse_interval("--surge", *arguments.surge);
  if (arguments.yaw_rate) options.max_yaw_rate = parse_magnitude("--yaw-rate", *arguments.yaw_rate);
  if (arguments.limits) options.limits = parse_limits("--limits", *arguments.limits);
  if (arguments.limits && !options.surge && !options.max_yaw_rate)
    throw Error("--limits says how --surge and --yaw-rate are held; give one of them too");
  if (arguments.loss) options.loss = parse_loss("--loss", *arguments.loss);
  if (arguments.max_keyframes)
    options.max_keyframes = static_cast<std::size_t>(parse_count("--max-keyframes", *arguments.max_keyframes));
  return options;
}

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
        options.stop = &interrupted;
      },
      solver);
  return solver;
}

/// Sends to standard error what a solver's library prints: standard output is for results.
class LibrariesPrintToStderr {
 public:
  LibrariesPrintToStderr() : output_(dup(STDOUT_FILENO)) { redirect(STDERR_FILENO); }
  ~LibrariesPrintToStderr() {
    redirect(output_);
    close(output_);
  }
  LibrariesPrintToStderr(const LibrariesPrintToStderr&) = delete;
  LibrariesPrintToStderr& operator=(const LibrariesPrintToStderr&) = delete;

 private:
  static void redirect(int to) {
    std::fflush(stdout);
    dup2(to, STDOUT_FILENO);
  }
  int output_;
};

Estimate estimate_with_progress(const Scenario& scenario, const TrackingOptions& options, Solver solver, bool quiet) {
  ProgressLine line;
  if (!quiet && isatty(STDERR_FILENO))
    std::visit([&](SolverOptions& o) { o.progress = [&](const Progress& progress) { line.show(progress); }; }, solver);
  const LibrariesPrintToStderr redirection;
  return estimate(scenario, options, solver);
}

/// Returns a note about plots that are missing, or nothing.
std::string write_everything(const Estimate& estimate, const Scenario& scenario, const OutputFolder& out,
                             std::optional<PlotFormat> plots) {
  std::string note;
  out.fill({"chaser.tum", "target.tum", "errors.csv", "summary.json", "trajectories.svg", "errors.svg",
            "trajectories.png", "errors.png"},
           [&](const std::filesystem::path& folder) {
             write_results(estimate, folder);
             if (plots) note = draw_plots(estimate, scenario, *plots, folder);
           });
  return note;
}

}  // namespace

int run_estimate(const EstimateArguments& arguments) {
  const TrackingOptions options = tracking_options(arguments);
  const Solver solver = solver_with_options(arguments);
  const auto plots = parse_plots("--plots", arguments.plots.value_or("svg"));
  std::optional<OutputFolder> out;
  if (arguments.out) out.emplace(*arguments.out);
  Scenario scenario = read_scenario(find_scenario(arguments.scenario, builtin_scenarios()));
  for (const std::string& assignment : arguments.noise) override_noise(scenario.data, assignment);

  stop_on_interrupt();
  const Estimate result = estimate_with_progress(scenario, options, solver, arguments.quiet);

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
