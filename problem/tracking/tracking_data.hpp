#pragma once

#include <memory>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>

namespace tandem {

/// Standard deviations of a tracking problem. Pose tangents are ordered x y z [m], then rotation about x y z [rad]; in
/// the plane they are x y [m], then heading [rad].
struct TrackingNoise {
  static constexpr double kDefaultTimeConstant = 60;  ///< s; of damped motion models

  // The builder throws Error if it needs one of these and finds zeros. Odometry and the motion models are per √s.
  Eigen::VectorXd prior, odometry, constant_twist;
  Eigen::VectorXd constant_velocity;  ///< for points in Mode B and constant velocity; world axes [m]
  /// Root spectral density of the acceleration along body axes [m s^-3/2, rad s^-3/2]. Zero: the values of
  /// constant_twist, which are equivalent for keyframes 1 s apart.
  Eigen::VectorXd acceleration;
  /// Time constants of the body twist (damped twist) and of a point's velocity along world axes (damped velocity) [s].
  Eigen::VectorXd twist_time, velocity_time;
  Eigen::VectorXd boundary;             ///< Mode B: between a pose and the point at the same keyframe [m].
  Vector<2> roll_pitch{0.04, 0.04};     ///< rad
  Vector<2> non_holonomic{0.05, 0.05};  ///< Sway and heave [m/s], if soft; planar problems use only sway.
  double surge = 0.05;                  ///< Excess over the surge limits [m/s], if soft.
  double yaw_rate = 0.01;               ///< Excess over the yaw-rate limit [rad/s], if soft.

  explicit TrackingNoise(bool planar = false)
      : prior(Eigen::VectorXd::Zero(planar ? 3 : 6)),
        odometry(prior),
        constant_twist(prior),
        constant_velocity(Eigen::VectorXd::Zero(planar ? 2 : 3)),
        acceleration(prior),
        twist_time(Eigen::VectorXd::Constant(prior.size(), kDefaultTimeConstant)),
        velocity_time(Eigen::VectorXd::Constant(planar ? 2 : 3, kDefaultTimeConstant)),
        boundary(Eigen::VectorXd::Constant(planar ? 2 : 3, 1e-3)) {}
};

struct EgoTrack;

/// Input of a tracking problem.
struct TrackingData {
  bool planar = false;                 ///< Estimate in SE(2), using x, y and heading of the poses.
  std::vector<Stamped<SE3>> odometry;  ///< Dead-reckoned chaser poses in time order, at any rate.
  std::vector<TargetSensor> sensors;   ///< Sensors that observe the target.
  TrackingNoise noise;                 ///< TrackingNoise(planar)
  double keyframe_interval = 1.0;      ///< Maximum time between keyframes [s].
  /// The chaser's own sensors (ego_track.hpp), if chaser and target are estimated jointly. Then `odometry` is only the
  /// initial guess of the chaser. Not supported if planar.
  std::shared_ptr<const EgoTrack> ego{};
};

}  // namespace tandem
