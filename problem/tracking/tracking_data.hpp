#pragma once

#include <memory>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>

namespace tandem {

/// Standard deviations; pose tangents are ordered x y z [m], then rotation about x y z [rad]; in the plane x y [m] and
/// heading [rad].
struct TrackingNoise {
  static constexpr double kForgotten = 60;  ///< s: of a motion that nothing else is said of

  // To be given where they are read: zeros are refused. All but `prior` per √s.
  Eigen::VectorXd prior, odometry, constant_twist;
  Eigen::VectorXd constant_velocity;  ///< of a point, along the world's axes [m]; Mode B and constant velocity
  /// Root spectral density of the acceleration, body axes [m s^-3/2, rad s^-3/2]; zero: the figures of constant_twist,
  /// which say the same at keyframes 1 s apart.
  Eigen::VectorXd acceleration;
  /// How fast the target's motion is forgotten: time constants of its body twist, and of a point's velocity along the
  /// world's axes [s]. Damped twist and damped velocity.
  Eigen::VectorXd twist_time, velocity_time;
  Eigen::VectorXd boundary;             ///< Mode B: between a pose and the point of the same instant [m]
  Vector<2> roll_pitch{0.04, 0.04};     ///< rad
  Vector<2> non_holonomic{0.05, 0.05};  ///< sway, heave [m/s], when soft; in the plane the first alone
  double surge = 0.05;                  ///< m/s outside the limits, when soft
  double yaw_rate = 0.01;               ///< rad/s outside the limits, when soft

  explicit TrackingNoise(bool planar = false)
      : prior(Eigen::VectorXd::Zero(planar ? 3 : 6)),
        odometry(prior),
        constant_twist(prior),
        constant_velocity(Eigen::VectorXd::Zero(planar ? 2 : 3)),
        acceleration(prior),
        twist_time(Eigen::VectorXd::Constant(prior.size(), kForgotten)),
        velocity_time(Eigen::VectorXd::Constant(planar ? 2 : 3, kForgotten)),
        boundary(Eigen::VectorXd::Constant(planar ? 2 : 3, 1e-3)) {}
};

struct EgoTrack;

/// What a tracking problem is made of: files, simulators and live feeds all end here.
struct TrackingData {
  bool planar = false;                 ///< estimate in SE(2): of poses x, y and heading count
  std::vector<Stamped<SE3>> odometry;  ///< dead-reckoned chaser poses in time order, at their own rate
  std::vector<TargetSensor> sensors;   ///< what observes the target
  TrackingNoise noise;                 ///< of the planar sizes when planar
  double keyframe_interval = 1.0;      ///< s, the longest time without a keyframe
  /// The chaser's own sensors (problem/ego_track.hpp): chaser and target are then estimated out of these and of
  /// `sensors` together, and `odometry` is a first guess of the chaser alone. Not when planar.
  std::shared_ptr<const EgoTrack> ego{};
};

}  // namespace tandem
