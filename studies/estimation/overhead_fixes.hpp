#pragma once

#include <string>

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// Finds a used fix in spherical coordinates whose azimuth is undefined or nearly so, because the target is within
/// three standard deviations of the sensor's z axis. Such fixes can prevent convergence. Returns for example "usbl at
/// 312.000 s sees the target 0.4 deg from the sensor's z axis" for the fix closest to the axis, else an empty string.
std::string overhead_fix(const TrackingData& data, const TrackingProblem& tracking);

}  // namespace tandem
