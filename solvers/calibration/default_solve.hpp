#pragma once

#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/solver.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem::detail {

/// Solves with the default solver of calibration: gauss_newton, or augmented_lagrangian if there are hard blocks.
Summary solve_with_default(Problem& problem, const Stop& stop, int max_iterations = 1000);

/// Default solver of a problem for comparisons of many models. It keeps its analysis, and is only as accurate as wanted.
class ApproximateSolver {
 public:
  /// The problem must outlive this object.
  explicit ApproximateSolver(Problem& problem);

  /// `cost_tolerance` is that of LevenbergMarquardtOptions, and has no effect with hard blocks.
  Summary solve(const Stop& stop, int max_iterations, double cost_tolerance = 1e-6);

 private:
  const Problem& problem_;
  Solver<> solver_;
};

}  // namespace tandem::detail
