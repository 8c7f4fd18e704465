#include <concepts>
#include <utility>

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

ApproximateSolver::ApproximateSolver(Problem& problem) : solver_(std::in_place_index<0>, problem) {
  if (problem.num_hard_blocks() > 0) solver_.emplace<1>(problem);
}

Summary ApproximateSolver::solve(const Stop& stop, int max_iterations, double cost_tolerance) {
  const auto solve = [&]<class Options>(Solver<Options>& solver) {
    Options& options = solver.options();
    options = limited_options<Options>(stop, max_iterations);
    if constexpr (std::same_as<Options, GaussNewtonOptions>) {
      options.cost_tolerance = cost_tolerance;
      options.gradient_tolerance = 1e-5;
      options.observability = false;
    }
    return solver.solve();
  };
  return std::visit(solve, solver_);
}

}  // namespace tandem::detail
