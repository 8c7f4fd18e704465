#pragma once

#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem::detail {

/// Solves with the default solver of calibration: gauss_newton, or augmented_lagrangian if there are hard blocks.
Summary solve_with_default(Problem& problem, const Stop& stop, int max_iterations = 1000);
/// Solves with the same solvers to an accuracy of the cost of 1e-6, for comparisons of many models.
Summary solve_approximately(Problem& problem, const Stop& stop, int max_iterations = 50);

}  // namespace tandem::detail
