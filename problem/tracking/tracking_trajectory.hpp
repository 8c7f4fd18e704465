#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <tandem/problem/tracking/tracking_data.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// Chaser and target at an instant.
struct TrackedInstant {
  double t;  ///< s
  SE3 chaser;
  Eigen::VectorXd chaser_twist;  ///< in the chaser's body [m/s, rad/s]; 3 rows in the plane
  TargetState target;
  /// In the target's body. A target without an orientation has its velocity in the world [m/s].
  Eigen::VectorXd target_twist;
  /// Covariances of [pose; twist] for right perturbations, or of [position; velocity]. Empty without covariances, and for
  /// a target on a steady course.
  Eigen::MatrixXd chaser_covariance, target_covariance;
};

/// Continuous trajectories of a tracking problem at its present values, by the interpolation of its motion priors:
///
/// - white_noise_acceleration: Gaussian-process interpolation of pose and twist (interpolate_white_noise);
/// - damped_twist and damped_velocity: Gaussian-process interpolation of the poses or points (interpolate_damped);
/// - other models, and the chaser: constant twist between keyframes.
///
/// Between a pose and a point, the target is a point.
class TrackingTrajectory {
 public:
  /// Returns the joint covariance of variables by id and tangent dimension, in this order: Marginals::joint(), or
  /// FixedLag::covariance().
  using Covariance = std::function<Eigen::MatrixXd(const std::vector<int>& ids, const std::vector<int>& dofs)>;

  /// The arguments must outlive this object.
  TrackingTrajectory(const TrackingProblem& tracking, const TrackingNoise& noise, const TrackingOptions& options)
      : tracking_(tracking), noise_(noise), options_(options) {}

  double first() const { return tracking_.keyframes.front().t; }  ///< s
  double last() const { return tracking_.keyframes.back().t; }    ///< s

  /// Returns the states at these times, with covariances if `covariance` is given. Throws BadInputError if a time is not
  /// between first() and last() or if there are fewer than two keyframes, and exceptions of `covariance`.
  std::vector<TrackedInstant> at(std::span<const double> times, const Covariance& covariance = {}) const;

 private:
  template <LieGroup G>
  TrackedInstant at(double t, std::size_t k, const Covariance& covariance) const;

  const TrackingProblem& tracking_;
  const TrackingNoise& noise_;
  const TrackingOptions& options_;
};

}  // namespace tandem
