#pragma once

#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/fit/likely_cause.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// Tries common mistakes for each target sensor with a misfit: axes swapped or negated, quaternion order, inverted
/// pose, degrees, compass angles, a delay, a bias (lever arm), a misalignment. Each is a solve of the part of the
/// recording with the sensor's first measurements. Returns the changes that remove at least a third of the part's cost,
/// the best first, at most three per sensor. Stops early, without an error, if `stop` requests it.
///
/// The motion model may hide wrong axes, so that no sensor has a misfit. If marginals show that residuals of a sensor
/// are significantly larger than expected, the changes without free parameters are tried. These must lower the cost by
/// 10, a likelihood ratio of e¹⁰, and by a twentieth.
std::vector<LikelyCause> likely_causes(const Scenario& scenario, const TrackingOptions& options, const FitReport& fit,
                                       const Stop& stop = {});

}  // namespace tandem
