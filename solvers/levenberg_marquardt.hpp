#pragma once

#include <string>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// What gauss-newton and augmented-lagrangian share: Levenberg–Marquardt steps by a sparse Cholesky factorisation, with
/// the curvature that Gauss-Newton leaves out learned from the last few of them (solvers/secant.hpp).
struct LevenbergMarquardtOptions : SolverOptions {
  double cost_tolerance = 1e-10;      ///< relative decrease of the cost below which it has converged
  double gradient_tolerance = 1e-10;  ///< largest gradient entry over the root of its curvature, against √(1 + cost)
  double step_tolerance = 1e-12;      ///< largest entry of a step [m, rad]
  double initial_damping = 1e-5;      ///< of the diagonal, at the first iteration
  int secant_pairs = 8;               ///< past steps to learn curvature from; 0 is plain Levenberg–Marquardt
};

namespace detail {

/// Minimises the cost, and where there are hard constraints the augmented Lagrangian, whose weights start at `penalty`
/// times the cost's own stiffness. `solver` is the name for the summary.
Summary levenberg_marquardt(Problem& problem, const char* solver, const LevenbergMarquardtOptions& options,
                            double penalty);
/// Throws Error when an option is out of its range.
void check(const char* solver, const LevenbergMarquardtOptions& options);

}  // namespace detail
}  // namespace tandem
