#pragma once

#include <optional>
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
/// rad, as TrackingNoise::constant_twist); or, given time constants [s] of the twist's components, by DampedTwist, whose
/// root spectral densities `noise` then are: the twist's own variance then stays below noise² τ/2. The covariance is
/// carried on to first order through the Jacobians of either. `fixes`: information [1/m², 1/rad²] on the pose that comes
/// after each step, by right perturbations, which makes its covariance less; none: nothing is measured. Throws Error when a
/// time is not positive, or there are not as many fixes as steps.
TargetPrediction predict_target(const TargetBelief& belief, const Vector<6>& noise, double dt, int steps,
                                const std::optional<Vector<6>>& time_constants = {},
                                const std::vector<Matrix<6, 6>>& fixes = {});

}  // namespace tandem
