#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {

/// Covariances at a keyframe; the pose's in the tangent space of right perturbations (x y z [m], then rotation about the
/// body's x y z [rad]), the others' in their own units.
struct EgoCovariance {
  Matrix<6, 6> pose = Matrix<6, 6>::Zero();
  Matrix<3, 3> velocity = Matrix<3, 3>::Zero();
  Matrix<6, 6> bias = Matrix<6, 6>::Zero();  ///< zero without an IMU
};

/// Of a keyframe of a solved problem.
EgoCovariance ego_covariance(const Marginals& marginals, const EgoKeyframe& keyframe);
/// Of the newest keyframe of a window.
EgoCovariance ego_covariance(const OnlineEstimator& estimator);

}  // namespace tandem
