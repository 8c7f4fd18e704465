#pragma once

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem {

/// Returns whether the data determine the range of a target of which only bearings are measured (AssumedRange), by
/// their information along the logarithm of the range. True if the problem has no assumed range.
///
/// The range counts as observable if two conditions hold. The data alone give it a standard deviation below a factor
/// 1.6. The data alone would not move it from the solution by more than this factor. The second condition detects the
/// pull towards the sensor, where bearings fit by themselves. `marginals` are those of the problem at its solution.
bool range_is_observable(const TrackingProblem& tracking, const Marginals& marginals);

}  // namespace tandem
