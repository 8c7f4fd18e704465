#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/problem/trajectory.hpp>
#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

/// A sensor on the chaser that sees the target's position, e.g. a USBL. Measures t((C B)⁻¹ (T F)) [m].
struct PositionSensor {
  std::string name = "usbl";
  Vector<3> sigma = Vector<3>::Zero();           ///< m
  SE3 mount;                                     ///< B: sensor in the chaser's body
  Vector<3> beacon = Vector<3>::Zero();          ///< t(F): beacon in the target's body [m]
  std::vector<Stamped<Vector<3>>> measurements;  ///< in time order
};

/// A sensor on the chaser that sees the target's pose, e.g. a camera on a marker. Measures (C B)⁻¹ (T F).
struct PoseSensor {
  std::string name = "optical";
  Vector<6> sigma = Vector<6>::Zero();     ///< m, rad
  SE3 mount;                               ///< B: sensor in the chaser's body
  SE3 marker;                              ///< F: marker in the target's body
  std::vector<Stamped<SE3>> measurements;  ///< in time order
};

/// Standard deviations; pose tangents are ordered x y z [m], then rotation about x y z [rad].
struct TrackingNoise {
  // To be given: zeros are refused. Odometry and constant twist per √s.
  Vector<6> prior = Vector<6>::Zero(), odometry = Vector<6>::Zero(), constant_twist = Vector<6>::Zero();
  Vector<2> roll_pitch{0.04, 0.04};     ///< rad
  Vector<2> non_holonomic{0.05, 0.05};  ///< sway, heave [m/s], when soft
  double surge = 0.05;                  ///< m/s outside the limits, when soft
  double yaw_rate = 0.01;               ///< rad/s outside the limits, when soft
};

/// What a tracking problem is made of: files, simulators and live feeds all end here.
struct TrackingData {
  std::vector<Stamped<SE3>> odometry;  ///< dead-reckoned chaser poses in time order, at their own rate
  std::vector<PositionSensor> position_sensors;
  std::vector<PoseSensor> pose_sensors;
  TrackingNoise noise;
  double keyframe_interval = 1.0;  ///< s, the longest time without a keyframe
};

enum class Role { off, soft, hard };

struct TrackingOptions {
  Role roll_pitch = Role::soft;
  Role non_holonomic = Role::off;        ///< sway = heave = 0 between consecutive target poses
  std::optional<Bounds<1>> surge{};      ///< limits of the mean surge [m/s]
  std::optional<double> max_yaw_rate{};  ///< limit of the mean yaw rate's magnitude [rad/s]
  Role limits = Role::hard;              ///< how surge and yaw rate are held
  Loss loss{};                           ///< on the relative measurements
  std::size_t max_keyframes = 0;         ///< keep the first ones only; 0: all
};

/// A keyframe counts as optical when it has a pose measurement, else as usbl when it has a position, else as gated.
enum class KeyframeType { usbl, optical, gated };

struct Keyframe {
  double t;  ///< s
  KeyframeType type;
  std::optional<Vector<3>>
      measured_position;                 ///< of the target in the chaser's body, by the sensor that gives the type
  std::optional<SO3> measured_rotation;  ///< likewise; only where optical
};

/// The joint MAP problem of a chaser and its target, Mode A: both in SE(3) at every keyframe.
/// Source: Baxter & Teran Espinoza 2025, §III.
struct TrackingProblem {
  Problem problem;
  std::vector<Keyframe> keyframes;
  std::vector<Variable<SE3>> chaser, target;  ///< one each a keyframe
};

/// Keyframes, residuals and the initial guess out of the data. Throws Error when the data cannot make a problem (no
/// odometry, no measurements, a measurement outside the odometry's time span).
TrackingProblem make_tracking_problem(const TrackingData& data, const TrackingOptions& options = {});

}  // namespace tandem
