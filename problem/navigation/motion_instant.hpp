#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// A body at an instant.
struct MotionInstant {
  Vector<3> position;           ///< world [m]
  std::optional<SO3> rotation;  ///< none for a point
  /// In the body [m/s, rad/s], 3 rows in the plane. A point has its velocity in the world [m/s], 3 or 2 rows.
  Eigen::VectorXd twist;
  /// Covariance of [pose; twist] for right perturbations, or of [position; velocity] of a point. May be empty.
  Eigen::MatrixXd covariance;
};

/// Function that returns J S Jᵀ, where S is the joint covariance of the variables with these IDs and tangent
/// dimensions: Marginals::propagated(), or the same with FixedLag::covariance().
using PropagateCovariance =
    std::function<Eigen::MatrixXd(const Eigen::MatrixXd& J, const std::vector<int>& ids, const std::vector<int>& dofs)>;

}  // namespace tandem
