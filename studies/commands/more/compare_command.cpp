#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/navigation/navigated.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kDenseKeyframes = 24;  // 288 unknowns, of 300 that nlopt:slsqp takes
/// A solve may run on after its limit, as long again and so many seconds: an evaluation may be slow.
constexpr double kGrace = 10;

struct CompareRequest {
  ProblemRequest problem;
  std::vector<Contender> solvers = contenders();
  std::vector<Role> roles = {Role::off, Role::soft, Role::hard};
  double time_limit = 60;  ///< s
  std::optional<std::size_t> dense_keyframes;
  Output output;
  std::string one, line;  ///< in a process of a solve's own: which solve, and how its progress line begins
};

/// What the options name, or else what keeps a vehicle from moving sideways and astern.
TargetConstraints constraints_meant(const ProblemRequest& request, const TrackingOptions& options) {
  TargetConstraints constraints = constraints_of(options);
  if (constraints.non_holonomic || constraints.roll_pitch || constraints.surge || constraints.max_yaw_rate)
    return constraints;
  constraints.non_holonomic = !request.non_holonomic;  // given, it is off
  constraints.surge = at_least(0);
  return constraints;
}

/// The problem's own errors before anything is run.
void check_problem(const Scenario& scenario, const ComparedProblem& problem) try {
  make_tracking_problem(scenario.data, with_constraints(problem.tracking, problem.constraints, problem.role),
                        Stop(&interrupted()));
} catch (const Stopped&) {
  throw;
} catch (const Error& error) {
  if (problem.role == Role::off) throw;
  throw Error(fmt::format("with {} constraints: {}", constraints_name(problem.role), error.what()));
}

/// How many keyframes there are problems of: as many as asked for and, where some solver keeps dense matrices, few.
std::vector<std::size_t> sizes(const CompareRequest& request, const Scenario& scenario) {
  const std::size_t few = request.dense_keyframes.value_or(kDenseKeyframes),
                    most = request.problem.target.max_keyframes;
  std::vector<std::size_t> result = {make_keyframes(scenario.data, most).size()};
  const bool dense =
      std::any_of(request.solvers.begin(), request.solvers.end(), [](const Contender& c) { return c.dense; });
  if ((request.dense_keyframes || (dense && most == 0)) && few < result.front()) result.push_back(few);
  return result;
}

Scenario read_and_navigate(const CompareRequest& request, const CommandOptions& option) {
  Scenario scenario = read_problem(request.problem, option, Stop(&interrupted()));
  if (!needs_navigation(scenario)) return scenario;
  return navigate_first(std::move(scenario), navigation_options(request.problem), request.output,
                        request.line + "navigation: ", request.time_limit);
}

ComparedProblem compared_problem(const CompareRequest& request) {
  ComparedProblem problem;
  problem.tracking = tracking_options(request.problem, true);
  problem.constraints = constraints_meant(request.problem, problem.tracking);
  problem.time_limit = request.time_limit;
  return problem;
}

/// Which solve of a comparison, as one process tells another.
std::string solve_text(std::size_t keyframes, Role role, const Contender& solver) {
  return fmt::format("{},{},{}", keyframes, constraints_name(role), solver.name);
}

/// In a process of its own: one of the solves, told on standard output.
int run_one(const CompareRequest& request, const CommandOptions& option) {
  const std::vector<std::string_view> parts = split(request.one, ',');
  if (parts.size() != 3) throw Error(fmt::format("{} is no solve", quote(request.one)));
  const Scenario scenario = read_and_navigate(request, option);
  ComparedProblem problem = compared_problem(request);
  problem.tracking.max_keyframes = static_cast<std::size_t>(parse_count("keyframes", std::string(parts[0])));
  problem.role = parse_constraints("constraints", std::string(parts[1])).front();
  Contender contender = parse_contenders("solver", std::string(parts[2])).front();
  const ComparedSolve solve = [&] {
    const WatchedSolve watched(common(contender.solver), request.output, request.line);
    return compare_one(scenario, problem, contender);
  }();
  fmt::print("{}", printable_lines(to_text(solve)));
  return kDone;
}

/// An interrupt ends it with the solves that are there.
int run_compare(const CompareRequest& request, const CommandOptions& option) {
  if (!request.one.empty()) return run_one(request, option);
  ComparedProblem problem = compared_problem(request);
  const auto begun = std::chrono::steady_clock::now();
  const Scenario scenario = read_and_navigate(request, option);
  const double to_read = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  const std::vector<std::size_t> keyframes = sizes(request, scenario);
  for (const Role role : request.roles) {
    problem.role = role;
    check_problem(scenario, problem);
  }

  Comparison comparison{scenario.name, problem.tracking.mode, problem.constraints, problem.time_limit, {}};
  const std::size_t all = keyframes.size() * request.roles.size() * request.solvers.size();
  for (const std::size_t size : keyframes)
    for (const Role role : request.roles)
      for (const Contender& solver : request.solvers) {
        if (interrupted()) break;
        std::vector<std::string> arguments = {
            "tandem",
            "compare",
            "--one",
            solve_text(size, role, solver),
            "--line",
            fmt::format("{}/{} {} keyframes, constraints {}, {}: ", comparison.solves.size() + 1, all, size,
                        constraints_name(role), solver.name)};
        arguments.insert(arguments.end(), option.words().begin(), option.words().end());
        const double seconds = 2.0 * (problem.time_limit + to_read) + kGrace;
        comparison.solves.push_back(compare_isolated(std::move(arguments), solver, role, seconds, interrupted()));
        comparison.solves.back().keyframes = size;
      }

  Results results;
  results.table = [&] { return report(comparison); };
  results.json = [&] { return compare_json(comparison); };
  results.plots_of = "compare";
  results.write = [&](const std::filesystem::path& folder) {
    write_file(folder / "compare.csv", compare_csv(comparison));
    write_file(folder / "compare_progress.csv", progress_csv(comparison));
  };
  if (interrupted()) results.not_done = fmt::format("interrupted after {} of {} solves", comparison.solves.size(), all);
  return finish(request.output, results);
}

}  // namespace

Command compare_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<CompareRequest>();
            option.footer(
                "The constraints are those that the options above name, whichever way; without any, no sway or heave "
                "and surge of zero or more. Exit status: 0 all were run, however they did, 1 wrong input or usage, 2 "
                "interrupted.");
            add_problem(option, request->problem, false);
            add_max_keyframes(option, request->problem);
            add_own_sensors(option, request->problem.own, true);
            option.group("Comparison");
            option("--solvers", "LIST",
                   "Of gauss-newton, augmented-lagrangian, ipopt, ipopt:HESSIAN, nlopt:ALGORITHM, nlopt (default all)",
                   request->solvers, parse_contenders);
            option("--constraints", "LIST", "Of none, soft and hard (default all three)", request->roles,
                   parse_constraints);
            option("--time-limit", "SECONDS", "Stop each solve after so long (default 60), and what is navigated first",
                   request->time_limit, parse_magnitude);
            option("--dense-keyframes", "N",
                   "Run all on the first N keyframes too, for solvers that keep dense matrices (default 24, or none "
                   "with --max-keyframes)",
                   request->dense_keyframes, [](const std::string& name, const std::string& text) {
                     return static_cast<std::size_t>(parse_count(name, text));
                   });
            add_threads(option);
            option.hidden("--one", request->one);
            option.hidden("--line", request->line);
            add_output(option, request->output,
                       {.writes = "Write compare.csv, compare_progress.csv and a plot of cost by time to DIR"});
            return [request, &option] { return run_compare(*request, option); };
          },
          true};
}

}  // namespace tandem
