#pragma once

#include <vector>

#include <tandem/problem/tracking/keyframes.hpp>

namespace tandem::detail {

/// Position and velocity of a point over the keyframes.
struct SmoothedTrack {
  std::vector<Vector<3>> position, velocity;  // m, m/s
  std::vector<double> variance;               // of the position along each axis [m²]
};
struct PositionFix {
  std::size_t keyframe;
  Vector<3> position;                 // m, world
  double variance;                    // m²
  std::size_t sensor = 0, index = 0;  // in the data
};

/// Kalman filter and Rauch-Tung-Striebel smoother of white noise on acceleration with density q [m²/s³], over one fix
/// or more in keyframe order. All three axes share one 2 × 2 covariance, since the fixes are taken as isotropic.
SmoothedTrack smooth(const std::vector<Keyframe>& keyframes, const std::vector<PositionFix>& fixes, double q);

}  // namespace tandem::detail
