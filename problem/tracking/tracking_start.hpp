#pragma once

#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/outliers.hpp>

namespace tandem {

/// A first guess of the target over the keyframes.
struct TargetStart {
  std::vector<SE3> pose;
  std::vector<Vector<3>> velocity;  ///< m/s, world
  std::vector<Outlier> outliers;    ///< that it is without, where it is robust
};

/// The first guess from the measurements, seen from `chaser` poses: positions smoothed at constant velocity,
/// orientations from pose measurements, and far from any of those along the direction of travel. Where no sensor gives
/// positions: the constant velocity that fits the bearings best, or, with ranges alone, ahead of the chaser. `robust`:
/// without outliers(), and without the orientations that disagree with their neighbours and the direction of
/// travel, such as turned detections. Throws Stopped when it is to stop.
TargetStart initial_target(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                           const std::vector<SE3>& chaser, bool robust = false, const Stop& stop = {});

/// The straight line at constant speed that fits the guessed positions best, heading along it.
TargetStart straightened(const TargetStart& start, const std::vector<Keyframe>& keyframes);

}  // namespace tandem
