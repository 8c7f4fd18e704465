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

/// What every solver understands, of the one that is chosen.
SolverOptions& common(Solver& solver);
const SolverOptions& common(const Solver& solver);

/// Whether it takes limits as hard constraints, going by its kind: gauss-newton, some of NLopt's algorithms and Ipopt with
/// limited memory do not.
bool takes_hard_limits(const Solver& solver);

/// Their names: gauss-newton, augmented-lagrangian, ipopt and, in a build with NLopt, nlopt:ALGORITHM.
std::vector<std::string> solver_names();

}  // namespace tandem
