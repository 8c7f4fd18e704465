#pragma once

#include <vector>

#include <tandem/problem/tracking/keyframes.hpp>

namespace tandem {

/// A first guess of the target over the keyframes.
struct TargetStart {
  std::vector<SE3> pose;
  std::vector<Vector<3>> velocity;  ///< m/s, world
};

/// A measured position that the others contradict.
struct PositionOutlier {
  std::size_t sensor, index;  ///< in the data
  double sigmas;              ///< its distance from where the others put the target, in standard deviations of that
};

/// Measured positions more than ten standard deviations from where all others put a target of constant velocity, the
/// data's noise being what it may change by. By data snooping: while some are, the one whose residual is the most standard
/// deviations of its own is taken out, and at the end those that then agree are let in again. One outlier, however far,
/// is always the first to go. `chaser`: its poses at the keyframes. Source: Baarda 1968, "A testing procedure for use in
/// geodetic networks".
std::vector<PositionOutlier> position_outliers(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                               const std::vector<SE3>& chaser);

/// The first guess from the measurements, seen from `chaser` poses: positions smoothed at constant velocity,
/// orientations from pose measurements, and far from any of those along the direction of travel. Where no sensor gives
/// positions: the constant velocity that fits the bearings best, or, with ranges alone, ahead of the chaser. `robust`:
/// without position_outliers(), and without the orientations that disagree with their neighbours and the direction of
/// travel, such as turned detections.
TargetStart initial_target(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                           const std::vector<SE3>& chaser, bool robust = false);

/// The straight line at constant speed that fits the guessed positions best, heading along it.
TargetStart straightened(const TargetStart& start, const std::vector<Keyframe>& keyframes);

}  // namespace tandem
