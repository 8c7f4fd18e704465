#pragma once

#include <cstddef>
#include <vector>

#include <tandem/problem/tracking/keyframes.hpp>
#include <tandem/problem/tracking/outliers.hpp>
#include <tandem/problem/tracking/track_smoother.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem::detail {

/// A measurement that has a keyframe and is not held out.
struct UsableMeasurement {
  std::size_t sensor, index;  ///< indices in TrackingData::sensors and TargetSensor::measurements
  std::size_t keyframe;
};

/// Returns the usable measurements, except for those that `skip` marks by [sensor][index]. `skip` may be empty.
std::vector<UsableMeasurement> usable_measurements(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                                   const std::vector<std::vector<bool>>& skip = {});

/// Returns the mean variance per axis [m²] of a position that a sensor with these sigmas measures at a range [m].
double position_variance(SensorType type, const Eigen::VectorXd& sigma, bool planar, double range);

/// Returns the measured positions of the target in keyframe order. If `target` gives its poses at the keyframes,
/// subtracts the lever arm of the marker.
std::vector<PositionFix> measured_positions(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                            const std::vector<SE3>& chaser,
                                            const std::vector<std::vector<bool>>& skip = {},
                                            const std::vector<SE3>* target = nullptr);

/// Returns the spectral density of the target's acceleration [m²/s³] from the noise of the motion model. It is the
/// largest over the axes, and 0 if no noise is given.
double target_acceleration_density(const TrackingData& data);

}  // namespace tandem::detail
