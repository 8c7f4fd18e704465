#pragma once

#include <optional>
#include <vector>

#include <tandem/lie/se3.hpp>

namespace tandem {

/// Estimate of a target at two instants, from which its motion is predicted.
struct TargetBelief {
  SE3 before, now;  ///< previous and current pose
  double dt = 1.0;  ///< between the two poses [s]
  /// Joint covariance of [δ before; δ now], right perturbations [m, rad].
  Matrix<12, 12> covariance = Matrix<12, 12>::Zero();
};

/// Predicted motion of a target, now and after each step.
struct TargetPrediction {
  std::vector<SE3> pose;
  std::vector<Vector<6>> twist;          ///< body twist [m/s, rad/s]
  std::vector<Matrix<6, 6>> covariance;  ///< covariance of each pose, right perturbations [m, rad]
};

/// Predicts a target over `steps` steps of dt [s]. The covariance is propagated to first order.
///
/// Without `time_constants` the target keeps its twist up to noise with the variance `noise`² dt per step; `noise` is
/// in m/√s and rad/√s, as TrackingNoise::constant_twist. With `time_constants` τ [s] of the twist components it follows
/// DampedTwist, with `noise` as root spectral densities. The variance of the twist then stays below noise² τ/2.
///
/// `fixes` is the information that expected measurements add to the pose after each step [1/m², 1/rad²], in right
/// perturbations; empty if there are none. Throws Error if a time is not positive or the number of fixes is not
/// `steps`.
TargetPrediction predict_target(const TargetBelief& belief, const Vector<6>& noise, double dt, int steps,
                                const std::optional<Vector<6>>& time_constants = {},
                                const std::vector<Matrix<6, 6>>& fixes = {});

}  // namespace tandem
