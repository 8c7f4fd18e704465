#pragma once

#include <functional>
#include <optional>
#include <string>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/support/solver_choice.hpp>

namespace tandem {

/// --solver; without it `solver` stays as it is, which `otherwise` says.
void add_solver(CommandOptions& option, std::optional<Solver>& solver, const std::string& otherwise);
void add_solver(CommandOptions& option, Solver& solver, const std::string& otherwise = "gauss-newton");
/// --hessian, --linear-solver and --ipopt, for the solver that was chosen. Reading them throws Error when that is not ipopt.
void add_ipopt(CommandOptions& option, Solver& solver);
/// --max-iterations and --time-limit of the solver that was chosen.
void add_stops(CommandOptions& option, std::function<SolverOptions&()> options);
/// --write-problem, of a problem that is about to be solved: `built` is what writes it, where it is asked for.
void add_write_problem(CommandOptions& option, std::function<void(const Problem&)>& built);
/// --threads, which bounds those of all that the command evaluates.
void add_threads(CommandOptions& option);

}  // namespace tandem
