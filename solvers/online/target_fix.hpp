#pragma once

#include <string>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>

namespace tandem::detail {

/// Converts a measurement that includes a position to a fix of the target, in the frame of the pose `chaser`.
TargetFix target_fix(const TargetSensor& sensor, const Measurement& m, const SE3& chaser,
                     const TrackingOptions& options);

/// Returns the noise of the hypotheses for a scenario's noise, which is large enough for a smoother to follow any turn.
/// The drift hypothesis gets somewhat more noise, the course hypothesis much less.
HypothesesNoise hypotheses_noise(const TrackingNoise& noise);

/// Returns the limits of the hypotheses for the limits of a tracking problem.
HypothesesLimits hypotheses_limits(const TrackingOptions& options, const TrackingNoise& noise);

}  // namespace tandem::detail
