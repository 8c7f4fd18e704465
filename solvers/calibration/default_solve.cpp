#include <tandem/solvers/calibration/default_solve.hpp>

namespace tandem::detail {
namespace {

template <class Options>
Options limited_options(const Stop& stop, int iterations) {
  Options options;
  stop.limit(options);
  options.max_iterations = iterations;
  return options;
}

}  // namespace

Summary solve_with_default(Problem& problem, const Stop& stop, int max_iterations) {
  if (problem.num_hard_blocks() > 0)
    return solve(problem, limited_options<AugmentedLagrangianOptions>(stop, max_iterations));
  return solve(problem, limited_options<GaussNewtonOptions>(stop, max_iterations));
}

ApproximateSolver::ApproximateSolver(Problem& problem) : problem_(problem), solver_(problem) {}

Summary ApproximateSolver::solve(const Stop& stop, int max_iterations, double cost_tolerance) {
  auto options = limited_options<AugmentedLagrangianOptions>(stop, max_iterations);
  if (problem_.num_hard_blocks() == 0) {
    options.cost_tolerance = cost_tolerance;
    options.gradient_tolerance = 1e-5;
    options.observability = false;
  }
  solver_.options() = options;
  return solver_.solve();
}

}  // namespace tandem::detail
