#pragma once

#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Options of NLopt's local, gradient-based algorithms; see nlopt_algorithms().
struct NloptOptions : SolverOptions {
  NloptOptions() { max_iterations = 100000; }
  std::string algorithm = "lbfgs";
  double cost_tolerance = 1e-10;       ///< relative change of the cost
  double constraint_tolerance = 1e-8;  ///< tolerance on each hard constraint, in its own units
  bool precondition = true;  ///< solve in coordinates that whiten the Gauss-Newton Hessian at the initial guess
};

/// Maximum number of unknowns of "slsqp", whose matrices are dense. The time grows with the third power of it.
inline constexpr int kMaxDenseUnknowns = 300;

/// Returns the valid values of NloptOptions::algorithm, e.g. "lbfgs", "slsqp", "auglag-lbfgs". Empty in a build without
/// NLopt.
std::vector<std::string> nlopt_algorithms();

/// Returns the reason why this solver does not support the problem, or "". Throws Error if an option is invalid.
std::string why_unsupported(const Problem& problem, const NloptOptions& options);
/// Solves the problem; its variables get the best point found. If why_unsupported() gives a reason, the status is
/// `unsupported`.
Summary solve(Problem& problem, const NloptOptions& options);

}  // namespace tandem
