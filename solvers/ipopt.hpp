#pragma once

#include <map>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Hessian of the Lagrangian that a solver uses.
enum class Hessian {
  automatic,       ///< Gauss-Newton; exact after shortened steps near a solution or after many iterations.
  gauss_newton,    ///< JᵀWJ of the soft residuals, without curvature of the hard constraints.
  exact,           ///< Exact Hessian of the Lagrangian.
  limited_memory,  ///< Ipopt's quasi-Newton approximation; soft residuals only.
};

/// Linear solver of Ipopt.
enum class IpoptLinearSolver {
  /// block_cholesky if this version of Ipopt supports it and `options` name no other solver or scaling, otherwise mumps
  automatic,
  block_cholesky,  ///< Tandem's block factorisation; concurrent solves are allowed
  /// MUMPS. Solves of one process run one after the other. A solve from the callback of another one never returns.
  mumps,
};

/// Options of Ipopt's interior-point method, which supports any mix of soft and hard residuals.
struct IpoptOptions : SolverOptions {
  double tolerance = 1e-8;  ///< Ipopt's `tol`, with unknowns scaled to unit curvature at the initial guess
  Hessian hessian = Hessian::automatic;
  IpoptLinearSolver linear_solver = IpoptLinearSolver::automatic;
  std::map<std::string, std::string> options;  ///< Ipopt options by name, e.g. {"mu_strategy", "adaptive"}
};

/// Returns whether this build of Tandem includes Ipopt.
bool ipopt_available();

/// Returns the reason why this solver does not support the problem, or "". Throws Error if an option is invalid.
std::string why_unsupported(const Problem& problem, const IpoptOptions& options);
/// Solves the problem; its variables get the best point found. If why_unsupported() gives a reason, the status is
/// `unsupported`.
Summary solve(Problem& problem, const IpoptOptions& options);

}  // namespace tandem
