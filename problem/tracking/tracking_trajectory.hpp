#pragma once

#include <optional>
#include <span>
#include <vector>

#include <tandem/problem/navigation/ego_trajectory.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/motion_interpolation.hpp>

namespace tandem {

/// Chaser and target at an instant.
struct TrackedInstant {
  double t;  ///< s
  MotionInstant chaser;
  MotionInstant target;
};

/// Variables of chaser and target in a whole recording or in a sliding window, one entry per keyframe each.
struct TrackedStates {
  const Problem& problem;
  std::span<const Keyframe> keyframes;
  std::span<const PoseVariable> chaser;
  std::span<const TargetVariable> target;
  std::span<const TwistVariable> twist;  ///< empty unless the model is white_noise_acceleration
};

/// Continuous trajectories of a tracking problem at its present values, by the interpolation of its motion priors.
///
/// Chaser: along its odometry, whose misclosure between keyframes is distributed (interpolate_along_odometry), or by
/// its own sensors (EgoTrajectory); with a constant twist where there is no odometry.
///
/// Target:
/// - white_noise_acceleration: Gaussian-process interpolation of pose and twist (interpolate_white_noise);
/// - damped_twist and damped_velocity: Gaussian-process interpolation of the poses or points (interpolate_damped);
/// - steady_course: its course;
/// - other models: constant twist between keyframes. Between a pose and a point, the target is a point.
class TrackingTrajectory {
 public:
  /// The arguments must outlive this object.
  TrackingTrajectory(const TrackingProblem& tracking, const TrackingData& data, const TrackingOptions& options);
  /// Uses noise and `odometry` (in time order), which may be empty.
  TrackingTrajectory(const TrackedStates& states, const TrackingNoise& noise, const std::vector<Stamped<SE3>>& odometry,
                     const TrackingOptions& options)
      : states_(states), noise_(noise), odometry_(odometry), options_(options) {}

  TrackingTrajectory(const TrackingTrajectory&) = delete;  // the own sensors' trajectory refers to a member

  double first() const { return states_.keyframes.front().t; }  ///< s
  double last() const { return states_.keyframes.back().t; }    ///< s

  /// Return the states at t, with covariances if `propagate` is given. Throw BadInputError if t is not between first()
  /// and last() or if there are fewer than two keyframes, and exceptions of `propagate`.
  TrackedInstant at(double t, const PropagateCovariance& propagate = {}) const;
  MotionInstant chaser_at(double t, const PropagateCovariance& propagate = {}) const;
  MotionInstant target_at(double t, const PropagateCovariance& propagate = {}) const;

 private:
  template <LieGroup G>
  MotionInstant chaser(double t, const PropagateCovariance& propagate) const;
  template <LieGroup G>
  MotionInstant target(double t, const PropagateCovariance& propagate) const;
  template <LieGroup G>
  std::optional<OdometryAt<G>> odometry_at(double from, double t, double to) const;

  TrackedStates states_;
  const TrackingNoise& noise_;
  const std::vector<Stamped<SE3>>& odometry_;
  const TrackingOptions& options_;
  std::optional<ImuRecord> imu_;
  std::optional<EgoTrajectory> ego_;
};

}  // namespace tandem
