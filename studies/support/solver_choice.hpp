#pragma once

#include <string>
#include <variant>
#include <vector>

#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

namespace tandem {

/// A solver with its options.
using Solver = std::variant<GaussNewtonOptions, AugmentedLagrangianOptions, IpoptOptions, NloptOptions>;

/// Returns the options that all solvers share.
SolverOptions& common(Solver& solver);
const SolverOptions& common(const Solver& solver);

/// Returns whether the solver accepts inequality limits as hard constraints. Gauss-Newton, Ipopt with a limited-memory
/// Hessian and some NLopt algorithms do not.
bool supports_hard_limits(const Solver& solver);

/// Returns the solver names: gauss-newton, augmented-lagrangian, ipopt and, in builds with NLopt, nlopt:ALGORITHM.
std::vector<std::string> solver_names();

}  // namespace tandem
