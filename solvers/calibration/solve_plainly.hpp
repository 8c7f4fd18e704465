#pragma once

#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem::detail {

/// What calibration solves with where nothing else is said: gauss_newton, or augmented_lagrangian where there are hard
/// blocks.
Summary solve_plainly(Problem& problem, const Stop& stop, int max_iterations = 1000);

}  // namespace tandem::detail
