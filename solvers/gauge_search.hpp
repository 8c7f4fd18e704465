#pragma once

#include <vector>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

struct FlatDirection;

/// Pivots below this ratio to their diagonal entry are candidates for gauges. The pivot of an unknown is its
/// information once all later unknowns are known, so measured unknowns and the inner unknowns of chains have large
/// ratios.
inline constexpr double kSuspiciousPivot = 2e-2;

/// Finds gauges: directions along which the cost is constant although the Gauss-Newton Hessian H has curvature there.
///
/// A gauge turns or scales residuals that are not zero without changing their norm. An example is a turn of all target
/// poses about their own axes, if only positions are measured and the motion noise is isotropic. H counts the turn of
/// the residuals as information. The exact Hessian E of the cost has none: E v = 0.
///
/// `cholesky` has factorised H = L Lᵀ, with the null directions in `known` pinned. A small pivot, relative to its
/// diagonal entry, indicates a candidate. From there, the Lanczos process finds the smallest eigenvalue of L⁻¹ E L⁻ᵀ,
/// whose eigenvalues are near 1 except where H is wrong. A finite move then confirms that the cost is constant. It
/// follows the valley of the cost, so that gauges may be curved. Without small pivots, the search costs nothing. If E
/// and H agree along all candidates, it costs one gradient, otherwise two gradients per Lanczos step, at most 150 steps
/// per candidate. A candidate that has not converged after these steps ends the search, as its neighbours in the
/// spectrum would not converge either.
///
/// Far from a minimum there is no search: the residuals that a gauge could turn are those that remain at a minimum. The
/// point is far if a Gauss-Newton step is predicted to remove more than half of the cost.
///
/// `gradient` is that of the cost at X̄. `weights` are the weights of the constraint rows in H, 0 for inactive ones.
/// Throws Error if a residual is undefined, Stopped if `stop` ends the search.
std::vector<Eigen::VectorXd> gauges(NlpEvaluator& nlp, const BlockCholesky& cholesky, const Eigen::VectorXd& weights,
                                    const std::vector<FlatDirection>& known, const Eigen::VectorXd& gradient,
                                    const Stop& stop);

}  // namespace tandem::detail
