#pragma once

#include <vector>

#include <tandem/lie/se3.hpp>

namespace tandem {

/// What is known of a target at two instants: where its motion is predicted from.
struct TargetBelief {
  SE3 before, now;  ///< poses
  double dt = 1.0;  ///< s between them
  /// Of [δ before; δ now], right perturbations [m, rad].
  Matrix<12, 12> covariance = Matrix<12, 12>::Zero();
};

/// Where a target will be.
struct TargetPrediction {
  std::vector<SE3> pose;                 ///< now, and after each step
  std::vector<Vector<6>> twist;          ///< body twist at each [m/s, rad/s]
  std::vector<Matrix<6, 6>> covariance;  ///< of each pose, by right perturbations [m, rad]
};

/// `steps` steps of dt [s] ahead by constant twist, whose noise grows as `noise`² dt (standard deviations per √s, m and
/// rad, as TrackingNoise::constant_twist): the covariance is carried on to first order through the Jacobians of
/// ConstantTwist. Throws Error when a time is not positive.
TargetPrediction predict_target(const TargetBelief& belief, const Vector<6>& noise, double dt, int steps);

}  // namespace tandem
