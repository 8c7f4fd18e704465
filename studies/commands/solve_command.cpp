#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/file/problem_file.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct SolveRequest {
  std::string file;
  AnySolver solver;
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

/// Selects the augmented Lagrangian for a problem with hard constraints if no solver was chosen, since Gauss-Newton
/// does not support them.
void choose_solver(const Problem& problem, AnySolver& solver, bool chosen) {
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
  if (!summary.unobservable.empty()) text += fmt::format("Unobservable: {}\n", describe(summary.unobservable));
  return text;
}

JsonFields<Solved> solved_fields() {
  using S = Solved;
  return JsonFields<S>()
      .add("variables", "number of variables", [](const S& s) { return s.variables; })
      .add("fixed", "number of fixed variables", [](const S& s) { return s.fixed; })
      .add("unknowns", "number of unknowns: tangent dimensions of the free variables",
           [](const S& s) { return s.size.unknowns; })
      .add("costs", "number of cost blocks", [](const S& s) { return s.costs; })
      .add("constraints", "number of constraint blocks", [](const S& s) { return s.constraints; })
      .add("equalities", "number of equality rows", [](const S& s) { return s.size.equalities; })
      .add("inequalities", "number of inequality rows", [](const S& s) { return s.size.inequalities; })
      .add("solver", "name of the solver", [](const S& s) { return s.summary.solver; })
      .add("status", "converged, or why the solve ended", [](const S& s) { return name(s.summary.status); })
      .add("message", "explanation of the status", [](const S& s) { return s.summary.message; })
      .add("unobservable", "unobservable states; empty if there are none",
           [](const S& s) { return describe(s.summary.unobservable); })
      .add("initial_cost", "cost of the values in the file", [](const S& s) { return s.summary.initial_cost; })
      .add("cost", "final cost", [](const S& s) { return s.summary.cost; })
      .add("max_violation", "largest violation of a hard constraint, in its own unit",
           [](const S& s) { return s.summary.max_violation; })
      .add("worst_constraint", "the constraint with that violation; empty if there is none",
           [](const S& s) { return s.summary.worst_constraint; })
      .add("iterations", "number of iterations", [](const S& s) { return s.summary.iterations; })
      .add("evaluations", "number of evaluations of the cost", [](const S& s) { return s.summary.evaluations; })
      .add("solve_seconds", "duration of the solve [s]", [](const S& s) { return s.summary.seconds; });
}

/// Runs the command. An interrupt ends the solve at its best point.
int run_solve(const SolveRequest& request, const CommandOptions& option) {
  Problem problem = read_problem(std::filesystem::path(request.file));
  stop_on_interrupt();  // while the file is read, there is nothing to return: an interrupt ends the process
  const std::vector<std::string> given = option.given("Solver");
  AnySolver solver = request.solver;
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
  results.json = [&] { return json_text(json_document("solve", solved_fields(), solved)); };
  results.incomplete_reason = why_not_converged(solved.summary);
  return finish(request.output, results);
}

}  // namespace

Command solve_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<SolveRequest>();
            option.argument("file", "FILE", "Problem file, as written by --write-problem or write_problem()",
                            request->file);
            option.group("Solver");
            add_solver(option, request->solver, "gauss-newton; augmented-lagrangian with hard constraints");
            add_stop_criteria(option, [request]() -> SolverOptions& { return common(request->solver); });
            add_threads(option);
            option.flag("--from-multipliers", "Start from the multipliers in the file (default: from zero)",
                        request->from_multipliers);
            add_ipopt(option, request->solver);
            option.group("Output");
            option.set("--write-solution", "FILE", "Write the problem with its solution to FILE",
                       [request](const std::string&, const std::string& text) { request->out = text; });
            add_printing(option, request->output);
            return [request, &option] { return run_solve(*request, option); };
          },
          false, [] { return std::vector{describe_json("--json", "solve", solved_fields())}; }};
}

TANDEM_COMMAND(solve, "Files", "Solve a nonlinear program from a problem file")

}  // namespace tandem
