#pragma once

#include <algorithm>
#include <concepts>
#include <functional>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Schedule of a graduated solve.
struct GraduationOptions {
  double divide = 4.0;      ///< divisor of the squared scales from one solve to the next; above 1
  double tolerance = 1e-6;  ///< relative cost tolerance before the last solve; at least that of the solver
};

namespace detail {

/// Solves the problem with its present loss scale, within `limits`, to the cost tolerance `tolerance` or looser.
using SolveOnce = std::function<Summary(const SolverOptions& limits, double tolerance)>;
Summary graduate(Problem& problem, const SolverOptions& options, const GraduationOptions& graduation,
                 const SolveOnce& solve);

}  // namespace detail

/// Solves a problem with robust losses by graduated non-convexity around any solver:
///
///     solve_graduated(problem, GaussNewtonOptions{});
///
/// Use it if the initial guess may be in the wrong basin of attraction. If the initial guess is good, solve directly:
/// the first solve, without losses, leaves that basin.
///
/// The first solve has no losses, because an initial guess made of measurements fits their outliers. Then each loss
/// scale c becomes w c. The first w is the least one with which each robust block is in the convex region of its loss.
/// Each solve starts from the previous solution with w² divided by `divide`, until w = 1. For Geman-McClure w² is μ of
/// the paper. Cauchy and Tukey go from least squares to their own shape in the same way. Huber is convex and gains only
/// by the initial guess.
///
/// The last solve uses the original losses. The summary has its status, cost and violation, the initial cost of the
/// original problem, and the sums of iterations, evaluations and times. Limits apply to all solves together. If one is
/// reached, the cost is that of the original problem at the last point. `progress` reports the cost with scaled losses.
/// The loss scale of the problem is restored, also after an exception. Without robust losses this is a plain solve.
///
/// Sources: Yang, Antonante, Tzoumas & Carlone 2020, "Graduated Non-Convexity for Robust Spatial Perception", §III,
/// with full solves in place of weighted least squares; Blake & Zisserman 1987; Black & Rangarajan 1996.
template <std::derived_from<SolverOptions> Options>
Summary solve_graduated(Problem& problem, const Options& options, const GraduationOptions& graduation = {}) {
  return detail::graduate(problem, options, graduation, [&](const SolverOptions& limits, double tolerance) {
    Options o = options;
    static_cast<SolverOptions&>(o) = limits;
    if constexpr (requires { o.cost_tolerance; }) o.cost_tolerance = std::max(o.cost_tolerance, tolerance);
    if constexpr (requires { o.tolerance; }) o.tolerance = std::max(o.tolerance, tolerance);
    return solve(problem, o);
  });
}

}  // namespace tandem
