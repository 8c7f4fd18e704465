#pragma once

#include <optional>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>

namespace tandem {

/// Returns the standard deviation of a scalar variable from the curvature of the Laplace evidence −F − ½ log det H
/// along it.
///
/// For each trial value, all other variables are optimised. Central differences use `step` first, then the resulting
/// standard deviation, at most `most`. The result is infinite if the evidence does not decrease. It is empty if the
/// problem has hard blocks, if a solve does not converge, or if a direction is unobservable. Throws Stopped if `stop`
/// requests it.
///
/// Marginals are not enough for a variable that changes how measurements relate to the other states, such as a time
/// delay between keyframes. There the curvature of F exceeds its Gauss-Newton part, and log det H changes in the
/// opposite direction.
std::optional<double> profile_evidence_sigma(const Problem& solved, const Variable<Rn<1>>& x, double step, double most,
                                             const Stop& stop = {});

/// Returns the evidence at other values of the variable minus that at the present value. An entry is NaN if the solve
/// does not converge or a direction is unobservable. Empty if the problem has hard blocks. Throws Stopped if `stop`
/// requests it.
std::vector<double> profile_evidence(const Problem& solved, const Variable<Rn<1>>& x, const std::vector<double>& values,
                                     const Stop& stop = {});

}  // namespace tandem
