#pragma once

#include <optional>
#include <vector>

#include <tandem/problem/tracking.hpp>

namespace tandem {

/// Keyframes of a tracking problem: at the first and last odometry time, at every relative measurement, and each
/// keyframe_interval after the last one while nothing arrives. Times closer than 1 ms are one. `most` > 0 keeps the
/// first ones only. Throws Error without odometry or measurements, or when a measurement is outside the odometry's
/// time span.
std::vector<Keyframe> make_keyframes(const TrackingData& data, std::size_t most = 0);

/// Index of the keyframe at time t, to 1 ms.
std::optional<std::size_t> keyframe_at(const std::vector<Keyframe>& keyframes, double t);

/// The odometry stream interpolated on SE(3) at the keyframes.
std::vector<SE3> odometry_at(const std::vector<Stamped<SE3>>& odometry, const std::vector<Keyframe>& keyframes);

/// A first guess of the target's poses from the measurements, seen from `chaser` poses: positions smoothed at constant
/// velocity, orientations from pose measurements, and far from any of those along the direction of travel.
std::vector<SE3> initial_target(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                const std::vector<SE3>& chaser);

}  // namespace tandem
