#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/calibration/solve_plainly.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace tandem::detail {
namespace {

template <class Options>
Options ending_after(const Stop& stop, int iterations) {
  Options options;
  stop.limit(options);
  options.max_iterations = iterations;
  return options;
}

}  // namespace

Summary solve_plainly(Problem& problem, const Stop& stop, int max_iterations) {
  if (problem.num_hard_blocks() > 0)
    return solve(problem, ending_after<AugmentedLagrangianOptions>(stop, max_iterations));
  return solve(problem, ending_after<GaussNewtonOptions>(stop, max_iterations));
}

}  // namespace tandem::detail
