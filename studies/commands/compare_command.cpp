#include <algorithm>
#include <chrono>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kDenseKeyframes = 24;  // 288 unknowns; nlopt:slsqp supports 300
constexpr double kGrace = 10;                // extra time before a solve that exceeds its limit is killed [s]

struct CompareRequest {
  ProblemRequest problem;
  std::vector<NamedSolver> solvers = available_solvers();
  std::vector<Role> roles = {Role::off, Role::soft, Role::hard};
  double time_limit = 60;  ///< s
  std::optional<std::size_t> dense_keyframes;
  bool full = false;
  Output output;
  std::string one, line;  ///< for the subprocess of one solve: the solve, and the start of its progress line
};

/// Returns the constraints that the options name. Without any: no sway, no heave, and surge ≥ 0.
TargetConstraints requested_constraints(const ProblemRequest& request, const TrackingOptions& options) {
  TargetConstraints constraints = constraints_of(options);
  if (constraints.non_holonomic || constraints.roll_pitch || constraints.surge || constraints.max_yaw_rate)
    return constraints;
  constraints.non_holonomic = !request.non_holonomic;  // an explicit --non-holonomic is "off" here
  constraints.surge = at_least(0);
  return constraints;
}

/// Builds the problem once, so that its errors are reported before any solver runs.
void check_problem(const Scenario& scenario, const ComparedProblem& problem) try {
  make_tracking_problem(scenario.data, with_constraints(problem.tracking, problem.constraints, problem.role),
                        Stop(&interrupted()));
} catch (const Stopped&) {
  throw;
} catch (const Error& error) {
  if (problem.role == Role::off) throw;
  throw Error(fmt::format("with {} constraints: {}", constraints_name(problem.role), error.what()));
}

/// Returns the problem sizes in keyframes: all requested ones, and a small size if some solver uses dense matrices.
std::vector<std::size_t> sizes(const CompareRequest& request, const Scenario& scenario) {
  const std::size_t few = request.dense_keyframes.value_or(kDenseKeyframes),
                    most = request.problem.target.max_keyframes;
  std::vector<std::size_t> result = {make_keyframes(scenario.data, most).size()};
  const bool dense =
      std::any_of(request.solvers.begin(), request.solvers.end(), [](const NamedSolver& c) { return c.dense; });
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
  problem.constraints = requested_constraints(request.problem, problem.tracking);
  problem.time_limit = request.time_limit;
  return problem;
}

/// Returns the value of --one, which names a solve of the comparison to a subprocess.
std::string solve_text(std::size_t keyframes, Role role, const NamedSolver& solver) {
  return fmt::format("{},{},{}", keyframes, constraints_name(role), solver.name);
}

/// Runs one of the solves in the subprocess and prints its result to standard output.
int run_one(const CompareRequest& request, const CommandOptions& option) {
  const std::vector<std::string_view> parts = split(request.one, ',');
  if (parts.size() != 3)
    throw Error(fmt::format("--one takes KEYFRAMES,CONSTRAINTS,SOLVER, not {}", quote(request.one)));
  const Scenario scenario = read_and_navigate(request, option);
  ComparedProblem problem = compared_problem(request);
  problem.tracking.max_keyframes = static_cast<std::size_t>(parse_count("keyframes", std::string(parts[0])));
  problem.role = parse_constraints("constraints", std::string(parts[1])).front();
  NamedSolver contender = parse_solver_list("solver", std::string(parts[2])).front();
  const ComparedSolve solve = [&] {
    const WatchedSolve watched(common(contender.solver), request.output, request.line);
    return run_compared_solve(scenario, problem, contender);
  }();
  print(printable_lines(to_text(solve)));
  return kSuccess;
}

/// Returns why the results are incomplete, or an empty string. Unsupported combinations are no solves.
std::string incomplete_reason(const std::vector<ComparedSolve>& solves, std::size_t all) {
  if (interrupted()) return fmt::format("interrupted after {} of {} solves", solves.size(), all);
  std::vector<std::string> names;
  std::size_t ran = 0, failed = 0;
  for (const ComparedSolve& s : solves) {
    if (s.status == name(Status::unsupported)) continue;
    ++ran;
    if (s.converged()) continue;
    ++failed;
    if (std::find(names.begin(), names.end(), s.solver) == names.end()) names.push_back(s.solver);
  }
  if (ran == 0) return "no solver supports the problem";
  if (failed == 0) return "";
  return fmt::format("{} of {} solves did not converge: {}", failed, ran, fmt::join(names, ", "));
}

/// Runs the command. An interrupt ends it with the solves so far.
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
      for (const NamedSolver& solver : request.solvers) {
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
        comparison.solves.push_back(compare_in_subprocess(std::move(arguments), solver, role, seconds, interrupted()));
        comparison.solves.back().keyframes = size;
      }

  Results results;
  results.table = [&] { return report(comparison, request.full); };
  results.json = [&] { return compare_json(comparison); };
  results.plots_command = "compare";
  results.write = [&](const std::filesystem::path& folder) {
    write_file(folder / "compare.csv", compare_csv(comparison));
    write_file(folder / "compare_progress.csv", progress_csv(comparison));
  };
  results.incomplete_reason = incomplete_reason(comparison.solves, all);
  return finish(request.output, results);
}

}  // namespace

Command compare_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<CompareRequest>();
        option.footer(
            "The constraints are those that the target options name, in any role; by default no sway, no heave and "
            "surge >= 0.");
        add_problem(option, request->problem, false);
        add_max_keyframes(option, request->problem);
        add_own_sensors(option, request->problem.own, true);
        option.group("Comparison");
        option("--solvers", "LIST",
               "Solvers, comma-separated (default: all). Each is gauss-newton, augmented-lagrangian, ipopt, "
               "ipopt:HESSIAN, "
               "nlopt:ALGORITHM or nlopt (all its algorithms)",
               request->solvers, parse_solver_list);
        option("--constraints", "LIST", "Roles of the constraints, comma-separated: off, soft, hard (default: all)",
               request->roles, parse_constraints);
        option("--time-limit", "SECONDS",
               "Wall-clock time limit of each solve (default 60). The navigation before the solves has the same limit",
               request->time_limit, parse_non_negative);
        option(
            "--dense-keyframes", "N",
            "Also run all solvers on the first N keyframes (default 24; none with --max-keyframes). Solvers with dense "
            "matrices support only small problems",
            request->dense_keyframes, [](const std::string& name, const std::string& text) {
              return static_cast<std::size_t>(parse_count(name, text));
            });
        add_threads(option);
        option.hidden("--one", request->one);
        option.hidden("--line", request->line);
        add_output(option, request->output,
                   {.writes = "Write compare.csv, compare_progress.csv and a plot of cost over time to DIR",
                    .force = &request->problem.force});
        option.flag("--full", "Print all rows instead of a summary", request->full);
        return [request, &option] { return run_compare(*request, option); };
      },
      true,
      [] {
        std::vector<FileDescription> files = compare_file_columns();
        files.push_back(compare_json_keys());
        return files;
      }};
}

TANDEM_COMMAND(compare, "Models and noise",
               "Compare solvers on a scenario without, with soft and with hard constraints")

}  // namespace tandem
