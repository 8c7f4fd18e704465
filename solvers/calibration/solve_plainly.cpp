#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/calibration/solve_plainly.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace tandem::detail {

Summary solve_plainly(Problem& problem) {
  if (problem.num_hard_blocks() > 0) return tandem::solve(problem, AugmentedLagrangianOptions{});
  return tandem::solve(problem, GaussNewtonOptions{});
}

}  // namespace tandem::detail
