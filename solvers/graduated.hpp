#pragma once

#include <algorithm>
#include <concepts>
#include <functional>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// On 900 rotation averages with 64 % outliers the defaults find 897, as many as 1.2 and 1e-3 in 0.7 of the iterations.
struct GraduationOptions {
  double divide = 4.0;      ///< squared scales are divided by this from one solve to the next; above 1
  double tolerance = 1e-6;  ///< relative, of the cost: the solves before the last end there if the solver's is tighter
};

namespace detail {

/// Solves the problem as it is, within `limits`, to no more than `tolerance`.
using SolveOnce = std::function<Summary(const SolverOptions& limits, double tolerance)>;
Summary graduate(Problem& problem, const SolverOptions& options, const GraduationOptions& graduation,
                 const SolveOnce& solve);

}  // namespace detail

/// Graduated non-convexity around a solver, for robust losses and a start that may be in the wrong valley:
///
///     solve_graduated(problem, GaussNewtonOptions{});
///
/// First a solve without losses, since a start made of measurements fits their outliers. Then every loss scale c becomes
/// w c, with the least w that puts each robust block into its loss's convex region, and each solve starts from the one
/// before with w² divided anew, until w = 1. For Geman-McClure w² is the paper's μ. Cauchy and Tukey go the same way
/// from least squares to their own shape; so does Huber, which is convex already and gains only by the start. A start
/// that is good already is better solved from directly: the solve without losses leaves it.
///
/// The last solve has the original losses, and its status, cost and violation are returned, with the initial cost of
/// the original problem and the others' iterations, evaluations and times added up. The limits hold for all solves
/// together, and when one is reached, the cost is the original one at the point reached. `progress` sees the
/// widened costs. The widening of the problem's losses is in the end what it was, also after an exception. Without
/// robust losses this is the plain solve.
/// Source: Yang, Antonante, Tzoumas & Carlone 2020, "Graduated Non-Convexity for Robust Spatial Perception", §III,
/// with the solves in place of its weighted least squares; Blake & Zisserman 1987, Black & Rangarajan 1996.
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
