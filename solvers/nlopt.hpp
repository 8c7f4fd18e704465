#pragma once

#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// NLopt's local, gradient-based algorithms by name: see nlopt_algorithms().
struct NloptOptions : SolverOptions {
  NloptOptions() { max_iterations = 100000; }
  std::string algorithm = "lbfgs";
  double cost_tolerance = 1e-10;       ///< relative change of the cost
  double constraint_tolerance = 1e-8;  ///< of each hard constraint, in its own units
  bool precondition = true;            ///< solve in the coordinates that whiten the Gauss-Newton Hessian at the start
};

/// As many unknowns as "slsqp" takes, whose matrices are dense: 4 ms an evaluation at 200, 219 ms at 800.
inline constexpr int kMostDenseUnknowns = 300;

/// The names NloptOptions::algorithm takes, e.g. "lbfgs", "slsqp", "auglag-lbfgs". Empty in a build without NLopt.
std::vector<std::string> nlopt_algorithms();

/// Empty, or a sentence that says why this solver cannot take the problem.
/// Throws Error when the algorithm's name is unknown.
std::string why_unsupported(const Problem& problem, const NloptOptions& options);
/// Leaves the best point found in the problem's variables, whatever the status; `unsupported` where why_unsupported().
Summary solve(Problem& problem, const NloptOptions& options);

}  // namespace tandem
