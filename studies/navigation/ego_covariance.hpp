#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/problem/navigation/motion_instant.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {

/// Covariances of the chaser's state at a keyframe.
struct EgoCovariance {
  Matrix<6, 6> pose = Matrix<6, 6>::Zero();      ///< right perturbations: x y z [m], then rotation [rad], body axes
  Matrix<3, 3> velocity = Matrix<3, 3>::Zero();  ///< along the world axes [m²/s²]
  Matrix<6, 6> bias = Matrix<6, 6>::Zero();      ///< accelerometer, then gyroscope; zero without an IMU
};

/// Returns the covariances at a keyframe of a solved problem.
EgoCovariance ego_covariance(const Marginals& marginals, const EgoKeyframe& keyframe);
/// Returns the covariances at the newest keyframe of an estimator.
EgoCovariance ego_covariance(const OnlineEstimator& estimator);

/// Returns Marginals::propagated() as a function, or an empty function for null. `marginals` must outlive it.
PropagateCovariance propagate_by(const Marginals* marginals);

}  // namespace tandem
