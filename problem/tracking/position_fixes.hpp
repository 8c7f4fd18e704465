#pragma once

#include <cstddef>
#include <vector>

#include <tandem/problem/tracking/keyframes.hpp>
#include <tandem/problem/tracking/outliers.hpp>
#include <tandem/problem/tracking/track_smoother.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem::detail {

/// A measurement that a problem may use.
struct UsableMeasurement {
  std::size_t sensor, index;  ///< in the data
  std::size_t keyframe;
};

/// All of them that `skip` does not mark, which is empty or of each measurement of each sensor.
std::vector<UsableMeasurement> usable_measurements(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                                   const std::vector<std::vector<bool>>& skip = {});

/// Mean variance along the axes of what a sensor of these sigmas sees at a range [m²].
double position_variance(SensorType type, const Eigen::VectorXd& sigma, bool planar, double range);

/// Measured positions of the target in keyframe order; `target`: its poses, by which a marker's lever arm is taken off.
std::vector<PositionFix> measured_positions(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                            const std::vector<SE3>& chaser,
                                            const std::vector<std::vector<bool>>& skip = {},
                                            const std::vector<SE3>* target = nullptr);

/// What a target's velocity may change by [m²/s³], from whichever model's noise there is; 0 where there is none.
double travel_density(const TrackingData& data);

}  // namespace tandem::detail
