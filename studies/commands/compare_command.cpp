#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/compare_command.hpp>
#include <tandem/studies/comparison/compare_plots.hpp>
#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/navigation/navigated.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/isolated.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_folder.hpp>

namespace tandem {
namespace {

constexpr double kTimeLimit = 60;            // s
constexpr std::size_t kDenseKeyframes = 24;  // 288 unknowns, of 300 that nlopt:slsqp takes
constexpr double kTimeToBuild = 600;         // s

/// What the options name, or else what keeps a vehicle from moving sideways and astern.
TargetConstraints constraints_meant(const TrackingArguments& arguments, const TrackingOptions& options) {
  if (arguments.limits)
    throw Error("compare holds the limits in each of the ways of --constraints: leave --limits out");
  TargetConstraints constraints = constraints_of(options);
  if (constraints.non_holonomic || constraints.roll_pitch || constraints.surge || constraints.max_yaw_rate)
    return constraints;
  constraints.non_holonomic = !arguments.non_holonomic;  // given, it is off
  constraints.surge = at_least(0);
  return constraints;
}

/// The problem's own errors before anything is run, in a process of its own: this one must stay as it is.
void check_problem(const Scenario& scenario, const ComparedProblem& problem) {
  const IsolatedRun run = run_isolated(
      [&] {
        make_tracking_problem(scenario.data, with_constraints(problem.tracking, problem.constraints, problem.role));
        return std::string();
      },
      kTimeToBuild, interrupted());
  if (!run.failure.empty())
    throw Error(problem.role == Role::off
                    ? run.failure
                    : fmt::format("with {} constraints: {}", constraints_name(problem.role), run.failure));
}

/// How many keyframes there are problems of: as many as asked for and, where some solver keeps dense matrices, few.
std::vector<std::size_t> sizes(const CompareArguments& arguments, const Scenario& scenario,
                               const TrackingOptions& options, const std::vector<Contender>& solvers) {
  const std::size_t few = arguments.dense_keyframes
                              ? std::size_t(parse_count("--dense-keyframes", *arguments.dense_keyframes))
                              : kDenseKeyframes;
  std::vector<std::size_t> result = {make_keyframes(scenario.data, options.max_keyframes).size()};
  const bool dense = std::any_of(solvers.begin(), solvers.end(), [](const Contender& c) { return c.dense; });
  if ((arguments.dense_keyframes || (dense && !arguments.tracking.max_keyframes)) && few < result.front())
    result.push_back(few);
  return result;
}

}  // namespace

int run_compare(const CompareArguments& arguments) {
  Comparison comparison;
  ComparedProblem problem;
  problem.tracking = tracking_options(arguments.tracking);
  problem.constraints = constraints_meant(arguments.tracking, problem.tracking);
  problem.time_limit = arguments.time_limit ? parse_magnitude("--time-limit", *arguments.time_limit) : kTimeLimit;
  const std::vector<Contender> solvers = parse_contenders("--solvers", arguments.solvers.value_or("all"));
  const std::vector<Role> roles = parse_constraints("--constraints", arguments.constraints.value_or("none,soft,hard"));
  const auto plots = parse_plots("--plots", arguments.plots.value_or("svg"));
  std::optional<OutputFolder> out;
  if (arguments.out) out.emplace(*arguments.out);
  Scenario scenario = scenario_with(arguments.tracking);
  if (needs_navigation(scenario)) scenario = navigated(std::move(scenario), {}).scenario;
  const std::vector<std::size_t> keyframes = sizes(arguments, scenario, problem.tracking, solvers);
  for (const Role role : roles) {
    problem.role = role;
    check_problem(scenario, problem);
  }
  comparison.scenario = scenario.name;
  comparison.mode = problem.tracking.mode;
  comparison.constraints = problem.constraints;
  comparison.time_limit = problem.time_limit;

  stop_on_interrupt();
  const bool progress = !arguments.quiet && isatty(STDERR_FILENO);
  const std::size_t all = keyframes.size() * roles.size() * solvers.size();
  for (const std::size_t size : keyframes)
    for (const Role role : roles)
      for (const Contender& solver : solvers) {
        if (interrupted()) break;
        problem.tracking.max_keyframes = size;
        problem.role = role;
        const std::string line = fmt::format("{}/{} {} keyframes, constraints {}, {}: ", comparison.solves.size() + 1,
                                             all, size, constraints_name(role), solver.name);
        comparison.solves.push_back(
            compare_isolated(scenario, problem, solver, interrupted(), progress ? line : std::string()));
        comparison.solves.back().keyframes = size;
      }

  std::string note;
  if (out)
    out->fill({"compare.csv", "compare_progress.csv", "compare.svg", "compare.png"},
              [&](const std::filesystem::path& folder) {
                write_file(folder / "compare.csv", compare_csv(comparison));
                write_file(folder / "compare_progress.csv", progress_csv(comparison));
                if (plots) note = draw_comparison(comparison, *plots, folder);
              });
  if (arguments.json) {
    fmt::print("{}", compare_json(comparison));
  } else if (!arguments.quiet) {
    fmt::print("{}", report(comparison));
    if (out) fmt::print("\nWritten to {}\n", *arguments.out);
  }
  std::fflush(stdout);
  if (!note.empty() && !arguments.quiet) fmt::print(stderr, "tandem: {}\n", note);
  if (!interrupted()) return 0;
  fmt::print(stderr, "tandem: interrupted after {} of {} solves\n", comparison.solves.size(), all);
  return 2;
}

}  // namespace tandem
