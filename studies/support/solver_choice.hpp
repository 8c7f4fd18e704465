#pragma once

#include <string>
#include <variant>
#include <vector>

#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

namespace tandem {

/// Options of one of the solvers; their type selects the solver.
using AnySolver = std::variant<GaussNewtonOptions, AugmentedLagrangianOptions, IpoptOptions, NloptOptions>;

/// Returns the options that all solvers share.
SolverOptions& common(AnySolver& solver);
const SolverOptions& common(const AnySolver& solver);

/// Returns whether the solver accepts inequality limits as hard constraints. Gauss-Newton, Ipopt with a limited-memory
/// Hessian and some NLopt algorithms do not.
bool supports_hard_limits(const AnySolver& solver);

/// Returns the solver names: gauss-newton, augmented-lagrangian, ipopt and, in builds with NLopt, nlopt:ALGORITHM.
std::vector<std::string> solver_names();

}  // namespace tandem
