#pragma once

#include <map>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Second derivatives for solvers that use them.
enum class Hessian {
  automatic,       ///< Gauss-Newton, and exact once its steps must be cut near a solution, or it takes long
  gauss_newton,    ///< JᵀWJ of the soft residuals; hard constraints contribute no curvature
  exact,           ///< of the Lagrangian
  limited_memory,  ///< Ipopt's quasi-Newton approximation; soft residuals only
};

/// What solves Ipopt's linear systems.
enum class IpoptLinearSolver {
  automatic,       ///< block_cholesky where this version of Ipopt takes one of ours (3.11, 3.12), else mumps
  block_cholesky,  ///< Tandem's own factor, on the blocks of the Hessian; any number of solves at once
  mumps,           ///< Ipopt's own. Solves of one process wait for each other, and one from another's callback for ever
};

/// Ipopt's interior-point method, for any mix of soft and hard residuals.
struct IpoptOptions : SolverOptions {
  double tolerance = 1e-8;  ///< Ipopt's tol, with each unknown in units of unit curvature at the start
  Hessian hessian = Hessian::automatic;
  IpoptLinearSolver linear_solver = IpoptLinearSolver::automatic;
  std::map<std::string, std::string> options;  ///< passed on by name, e.g. {"mu_strategy", "adaptive"}
};

/// Whether this build of Tandem has Ipopt.
bool ipopt_available();

/// Empty, or a sentence that says why this solver cannot take the problem.
/// Throws Error when an option is unknown to Ipopt or its value is not of the option's kind.
std::string why_unsupported(const Problem& problem, const IpoptOptions& options);
/// Leaves the best point found in the problem's variables, whatever the status; `unsupported` where why_unsupported().
Summary solve(Problem& problem, const IpoptOptions& options);

}  // namespace tandem
