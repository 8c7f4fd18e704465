#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/solvers/gauss_newton.hpp>

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

Summary solve_approximately(Problem& problem, const Stop& stop, int max_iterations) {
  if (problem.num_hard_blocks() > 0) return solve_with_default(problem, stop, max_iterations);
  auto options = limited_options<GaussNewtonOptions>(stop, max_iterations);
  options.cost_tolerance = 1e-6;
  options.gradient_tolerance = 1e-5;
  options.observability = false;
  return solve(problem, options);
}

}  // namespace tandem::detail
