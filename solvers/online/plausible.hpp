#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>

/// What no sensor reads and no vehicle does: bounds far from anything that is measured, so that one absurd number is not
/// summed up, squared or started from.
namespace tandem::detail {

bool is_plausible(const SE3& pose);          ///< within 1e8 m of the origin
bool is_plausible(const ImuSample& sample);  ///< |axes| up to 1e5 m/s² and 1e4 rad/s
bool is_plausible(const Measurement& m);     ///< within 1e7 m of the chaser
/// Up to EgoSensorTraits::most in size.
bool is_plausible(EgoSensorType type, const EgoMeasurement& m);

/// Whether a vehicle may have moved so between two poses: up to 200 m/s and 50 rad/s, and some centimetres at once.
bool follows(const Stamped<SE3>& before, const Stamped<SE3>& after);

/// How far off a chaser's state may be for all that a sensor of this type knew of it.
EgoSpread spread_without(EgoSensorType type);

}  // namespace tandem::detail
