#pragma once

#include <string>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/navigation/fit_delay.hpp>
#include <tandem/studies/support/solver_choice.hpp>

namespace tandem {

/// Fits the delay of a sensor that observes the target by solving with different delays from 0 to 3.2 s. The result is
/// the minimum of a parabola through the costs near the lowest one, and its standard deviation. All delays are compared
/// on the same measurements. Measurements that a delay would shift to a time before or after the chaser's motion are
/// discarded.
///
/// Throws Error if there is no such sensor or too few measurements remain, and Stopped at the solver's time limit, which
/// covers all solves.
DelayFit fit_target_delay(const TrackingData& data, const std::string& sensor, const TrackingOptions& options,
                          const AnySolver& solver, bool graduated = false, const DelayFitProgress& progress = {});

}  // namespace tandem
