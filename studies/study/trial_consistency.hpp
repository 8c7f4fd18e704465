#pragma once

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// Squared errors of a solved problem in units of its covariances, as means over keyframes, into a result: NEES of
/// chaser, target and relative pose, of the relative position with its coverage, and NIS of each sensor. Of a
/// measurement with residual r, noise R and Jacobian H that is part of the problem, whose states have the covariance
/// P,
///
///     NIS = rᵀ (R − H P Hᵀ)⁻¹ r,
///
/// which is that of its prediction by all other measurements (leave one out). Where a robust loss left a measurement
/// less than its whole weight it does not count; nor does, of NEES, a keyframe at which a hard constraint leaves no
/// covariance along some direction. Source: Bar-Shalom, Li & Kirubarajan 2001, "Estimation with Applications to
/// Tracking and Navigation", §5.4.2.
///
/// NEES are of keyframes whose target is a pose or a point, in space or in the plane. Throws Error when a direction is
/// free.
void add_consistency(TrackingProblem& tracking, const Scenario& scenario, TrialResult& result);

/// NIS of the chaser's own sensors, "nis_dvl", …, likewise.
void add_own_nis(const Problem& problem, const Marginals& marginals, const std::vector<EgoSensor>& sensors,
                 const std::vector<PlacedEgoMeasurement>& placed, TrialResult& result);

}  // namespace tandem
