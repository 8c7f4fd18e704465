#pragma once

#include <vector>

#include <tandem/problem/navigation/navigation_checks.hpp>

namespace tandem {

/// Replaces the readings of each sensor that reads at least four times per `keyframe_interval` by one per keyframe.
/// Without an IMU, only keyframes connect readings, so a compass at 10 Hz would need 10 keyframes a second.
///
/// Keyframes are at the readings of the slower sensors and at most `keyframe_interval` apart. Each reading belongs to
/// the nearest keyframe. A straight line in time, fitted by least squares, gives the value at the keyframe, which has
/// no error if the reading changes at a constant rate. EgoSensor::sigma becomes the standard deviation of these values,
/// or that of the 10 % with the fewest readings if they differ. Readings that contradict the others of their keyframe
/// are rejected, and so are values with a far larger standard deviation.
///
/// Has no effect with an IMU, or on its own result. `data` must be as check() leaves it. Returns one finding per
/// averaged sensor, and one for its rejected readings.
std::vector<NavigationFinding> average_readings(NavigationData& data);

}  // namespace tandem
