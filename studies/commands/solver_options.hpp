#pragma once

#include <functional>
#include <optional>
#include <string>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/support/solver_choice.hpp>

namespace tandem {

/// Adds --solver. Without it, `solver` is unchanged; `default_solver` names the default in the help text.
void add_solver(CommandOptions& option, std::optional<AnySolver>& solver, const std::string& default_solver);
void add_solver(CommandOptions& option, AnySolver& solver, const std::string& default_solver = "gauss-newton");
/// Adds the advanced options --hessian, --linear-solver and --ipopt. Their parsers throw Error if the chosen solver is
/// not ipopt.
void add_ipopt(CommandOptions& option, AnySolver& solver);
/// Adds --time-limit and the advanced option --max-iterations. `options` returns the options of the chosen solver.
void add_stop_criteria(CommandOptions& option, std::function<SolverOptions&()> options);
/// Adds the advanced option --write-problem. If given, sets `built` to a function that writes a problem before it is
/// solved.
void add_write_problem(CommandOptions& option, std::function<void(const Problem&)>& built);
/// Adds --threads, the maximum number of threads of all evaluations of the command.
void add_threads(CommandOptions& option);

}  // namespace tandem
