#pragma once

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// Adds consistency metrics of a solved problem to a trial result, as means over keyframes: NEES of chaser, target,
/// relative pose and relative position, coverage of the relative position, and NIS per sensor. For a measurement in the
/// problem with residual r, noise R and Jacobian H, and the state covariance P,
///
///     NIS = rᵀ (R − H P Hᵀ)⁻¹ r.
///
/// This is the leave-one-out NIS: the measurement is predicted by all others. Measurements that a robust loss
/// down-weights do not count. Keyframes at which a hard constraint makes the covariance singular have no NEES.
/// Throws Error if the problem is rank deficient.
/// Source: Bar-Shalom, Li & Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", §5.4.2.
void add_consistency(TrackingProblem& tracking, const Scenario& scenario, TrialResult& result);

/// Adds the NIS of each of the chaser's own sensors, defined as above.
void add_own_nis(const Problem& problem, const Marginals& marginals, const std::vector<EgoSensor>& sensors,
                 const std::vector<PlacedEgoMeasurement>& placed, TrialResult& result);

}  // namespace tandem
