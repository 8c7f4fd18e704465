#pragma once

#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/outliers.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// Initial guess of the target at each keyframe.
struct TargetGuess {
  std::vector<SE3> pose;
  std::vector<Vector<3>> velocity;  ///< world [m/s]
  std::vector<Outlier> outliers;    ///< measurements that the guess ignores, if it is robust
};

/// Computes the initial guess from the measurements and the chaser's poses at the keyframes. Positions are smoothed at
/// constant velocity. Orientations come from pose measurements nearby, or else from the direction of travel if it is
/// significant, or else from the motion noise (guess_orientations()). Without measured positions, the guess has the
/// constant velocity that fits the bearings best. With only ranges, the target is at rest ahead of the chaser.
///
/// TrackingOptions::robust_initial_guess ignores outliers(), and orientations that disagree with their neighbours and
/// the direction of travel, such as detections turned by 180°. Throws Stopped if `stop` requests it.
TargetGuess initial_target_guess(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                 const std::vector<SE3>& chaser, const TrackingOptions& options = {},
                                 const Stop& stop = {});

/// Fits a straight line at constant speed to the positions of a guess. The heading is along the line.
TargetGuess straight_line_guess(const TargetGuess& guess, const std::vector<Keyframe>& keyframes);

}  // namespace tandem
