#pragma once

#include <vector>

#include <tandem/problem/tracking/keyframes.hpp>

namespace tandem::detail {

/// Position and velocity of a point at the keyframes.
struct SmoothedTrack {
  std::vector<Vector<3>> position, velocity;  ///< world [m, m/s]
  std::vector<double> variance;               ///< position variance along each axis [m²]
  std::vector<double> velocity_variance;      ///< velocity variance along each axis [m²/s²]
};
/// A measured position.
struct PositionFix {
  std::size_t keyframe;
  Vector<3> position;                 ///< world [m]
  double variance;                    ///< along each axis [m²]
  std::size_t sensor = 0, index = 0;  ///< indices in TrackingData::sensors and TargetSensor::measurements
};

/// Smooths at least one fix, in keyframe order, with a Kalman filter and a Rauch-Tung-Striebel smoother. The model is
/// white noise on acceleration with spectral density q [m²/s³]. All axes share one 2 × 2 covariance.
SmoothedTrack smooth(const std::vector<Keyframe>& keyframes, const std::vector<PositionFix>& fixes, double q);

}  // namespace tandem::detail
