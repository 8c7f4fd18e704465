#pragma once

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Levenberg–Marquardt on a sparse Cholesky factorisation, for problems without hard constraints, with the curvature
/// that Gauss-Newton leaves out learned from the last few steps (solvers/secant.hpp).
struct GaussNewtonOptions : SolverOptions {
  double cost_tolerance = 1e-10;      ///< relative decrease of the cost below which it has converged
  double gradient_tolerance = 1e-10;  ///< largest gradient entry over the root of its curvature, against √(1 + cost)
  double step_tolerance = 1e-12;      ///< largest entry of a step [m, rad]
  double initial_damping = 1e-5;      ///< of the diagonal, at the first iteration
  int secant_pairs = 8;               ///< past steps to learn curvature from; 0 is plain Levenberg–Marquardt
};

/// Empty, or a sentence that says why this solver cannot take the problem.
std::string why_unsupported(const Problem& problem, const GaussNewtonOptions& options);
Summary solve(Problem& problem, const GaussNewtonOptions& options);

}  // namespace tandem
