#pragma once

#include <string>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>

namespace tandem::detail {

/// What a measurement that gives a position says of the target in the frame that `chaser` is in.
TargetFix target_fix(const TargetSensor& sensor, const Measurement& m, const SE3& chaser,
                     const TrackingOptions& options);

/// Out of the noise that a scenario gives the target's motion, which is as agile as a smoother needs it to follow any
/// turn: a point drifts by somewhat more, a course is held far better.
HypothesesNoise hypotheses_noise(const TrackingNoise& noise);

}  // namespace tandem::detail
