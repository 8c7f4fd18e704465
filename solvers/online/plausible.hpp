#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>

/// Plausibility checks. The bounds are far outside of real values; they keep absurd numbers out of sums, squares and
/// initial guesses.
namespace tandem::detail {

bool is_plausible(const SE3& pose);          ///< within 1e8 m of the origin
bool is_plausible(const ImuSample& sample);  ///< each axis within 1e5 m/s² and 1e4 rad/s
bool is_plausible(const Measurement& m);     ///< within 1e7 m of the chaser
/// The norm of the value is at most EgoSensorTraits::max_magnitude.
bool is_plausible(EgoSensorType type, const EgoMeasurement& m);

/// Returns whether a vehicle can move between two poses: at most 200 m/s and 50 rad/s, plus 0.05 m and 0.05 rad of
/// resolution.
bool is_plausible_motion(const Stamped<SE3>& before, const Stamped<SE3>& after);

/// Returns the standard deviations of a chaser's state after a sensor of this type has been found to be wrong.
EgoStateSigmas sigmas_without_sensor(EgoSensorType type);

}  // namespace tandem::detail
