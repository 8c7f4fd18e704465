#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/file/problem_file.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct SolveRequest {
  std::string file;
  Solver solver;
  std::string out;
  bool from_multipliers = false;
  Output output;
};

struct Solved {
  std::string file;
  int variables = 0, fixed = 0, costs = 0, constraints = 0;
  Problem::Size size{};
  Summary summary;
};

/// Gauss-Newton takes no hard constraints: where there are some, the augmented Lagrangian around it.
void choose_solver(const Problem& problem, Solver& solver, bool chosen) {
  if (chosen || problem.num_hard_blocks() == 0) return;
  AugmentedLagrangianOptions options;
  static_cast<SolverOptions&>(options) = common(solver);
  solver = options;
}

std::string table_of(const Solved& solved) {
  const Summary& summary = solved.summary;
  std::string text = fmt::format(
      "{}: {} variables ({} fixed), {} unknowns, {} costs, {} constraints ({} equalities, {} inequalities)\n",
      solved.file, solved.variables, solved.fixed, solved.size.unknowns, solved.costs, solved.constraints,
      solved.size.equalities, solved.size.inequalities);
  text += fmt::format("{}: {}, cost {:.9g} (from {:.6g}), {} iterations, {} evaluations, {:.3f} s\n", summary.solver,
                      name(summary.status), summary.cost, summary.initial_cost, summary.iterations, summary.evaluations,
                      summary.seconds);
  if (solved.constraints > 0) {
    text += fmt::format("largest violation of a hard constraint: {:.2g}", summary.max_violation);
    text += summary.worst_constraint.empty() ? "\n" : fmt::format(", {}\n", summary.worst_constraint);
  }
  if (!summary.converged()) text += fmt::format("NOT CONVERGED: {}\n", summary.message);
  return text;
}

std::string json_of(const Solved& solved) {
  const Summary& summary = solved.summary;
  return json_text({{"variables", solved.variables},
                    {"fixed", solved.fixed},
                    {"unknowns", solved.size.unknowns},
                    {"costs", solved.costs},
                    {"constraints", solved.constraints},
                    {"equalities", solved.size.equalities},
                    {"inequalities", solved.size.inequalities},
                    {"solver", summary.solver},
                    {"status", name(summary.status)},
                    {"message", summary.message},
                    {"initial_cost", summary.initial_cost},
                    {"cost", summary.cost},
                    {"max_violation", summary.max_violation},
                    {"worst_constraint", summary.worst_constraint},
                    {"iterations", summary.iterations},
                    {"evaluations", summary.evaluations},
                    {"solve_seconds", summary.seconds}});
}

/// An interrupt ends the solve at its best point.
int run_solve(const SolveRequest& request, const CommandOptions& option) {
  Problem problem = read_problem(std::filesystem::path(request.file));
  const std::vector<std::string> given = option.given("Solver");
  Solver solver = request.solver;
  choose_solver(problem, solver, std::find(given.begin(), given.end(), "--solver") != given.end());
  common(solver).from_multipliers = request.from_multipliers;

  Solved solved;
  solved.file = request.file;
  solved.variables = problem.num_variables();
  for (int id = 0; id < problem.id_bound(); ++id) solved.fixed += problem.is_fixed(id);
  solved.costs = problem.num_soft_blocks();
  solved.constraints = problem.num_hard_blocks();
  solved.size = problem.size();
  {
    const WatchedSolve watched(common(solver), request.output);
    solved.summary = std::visit(
        [&](const auto& options) {
          if (const std::string why = why_unsupported(problem, options); !why.empty())
            throw Error(fmt::format("{}: {}", request.file, why));
          return solve(problem, options);
        },
        solver);
  }
  if (!request.out.empty()) write_problem(problem, request.out);

  Results results;
  results.table = [&] {
    return table_of(solved) + (request.out.empty() ? "" : fmt::format("\nWritten to {}\n", printable(request.out)));
  };
  results.json = [&] { return json_of(solved); };
  results.not_done = why_not_converged(solved.summary);
  return finish(request.output, results);
}

}  // namespace

Command solve_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<SolveRequest>();
        option.footer("Exit status: 0 converged, 1 wrong input or usage, 2 not converged or cut short.");
        option.argument("FILE", "FILE", "A problem, as --write-problem or write_problem() leaves it", request->file);
        option.group("Solver");
        add_solver(option, request->solver, "gauss-newton, augmented-lagrangian for hard constraints");
        add_ipopt(option, request->solver);
        add_stops(option, [request]() -> SolverOptions& { return common(request->solver); });
        option.flag("--from-multipliers", "Start from the multipliers that the file has", request->from_multipliers);
        add_threads(option);
        option.group("Output");
        option.set("--out", "FILE", "Write the problem with its solution to FILE",
                   [request](const std::string&, const std::string& text) { request->out = text; });
        option.flag("--json", "Print JSON in place of tables, and nothing else", request->output.json);
        option.flag("--quiet", "Print no table, progress or notes", request->output.quiet);
        return [request, &option] { return run_solve(*request, option); };
      },
      true};
}

}  // namespace tandem
