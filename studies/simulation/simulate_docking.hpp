#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// Motion of a simulated target at its speed. On a circuit, a straight line or a circle it is a surface vessel without
/// sway. On a helix it descends with the nose along the path. A hovering target turns on the spot.
enum class TargetMotion { circuit, straight, circle, helix, hover };

/// USBL model: a position along the chaser's body axes, or range and bearings with lateral errors proportional to
/// range.
enum class UsblKind { position, range_bearing };

/// Options of a simulated docking. docking_parameters.hpp gives names, units and ranges.
struct DockingOptions {
  double minutes = 20;
  std::uint64_t seed = 1;
  double keyframe_interval = 1.0;  ///< maximum time between keyframes [s]

  TargetMotion motion = TargetMotion::circuit;
  bool planar = false;            ///< Chaser and target move in the plane; the estimation problem is on SE(2).
  double speed = 1.0;             ///< m/s
  double turn_radius = 35.0;      ///< m
  double weave = 0.0;             ///< Amplitude of the lateral oscillation, period 60 s; the heading follows [m].
  double waves = 0.03;            ///< Amplitude of roll and pitch [rad].
  double far = 40.0, near = 5.5;  ///< Maximum and minimum distance of the chaser behind the target [m].
  double approach = 240.0;        ///< Period of the approaches [s].

  UsblKind usbl = UsblKind::position;
  double usbl_period = 4.2;              ///< s
  double usbl_sigma = 1.72;              ///< σ of each axis, or of the range [m].
  double usbl_bearing_sigma = 0.04;      ///< σ of the angles of range_bearing [rad].
  double usbl_outliers = 0.0;            ///< Fraction of the fixes that are outliers.
  double usbl_outlier_sigma = 30.0;      ///< σ of each axis; replaces usbl_sigma [m].
  double usbl_latency = 0.0;             ///< Delay of the time stamps, declared as `delay` of the sensor [s].
  double optical_period = 0.5;           ///< s
  double optical_sigma = 0.137;          ///< m
  double optical_angle_sigma = 0.04;     ///< rad
  double optical_range = 9.0;            ///< Below this distance optical poses, above it USBL fixes [m].
  double optical_view = 360.0;           ///< Full angle of the forward cone of view [deg].
  double blind = 0.2;                    ///< Probability that a sensor is blind during a spell.
  double spell = 60.0;                   ///< Duration of a spell, an interval of constant visibility [s].
  double gap = 0.0, gap_period = 120.0;  ///< Duration and period of gaps without measurements of the target [s].

  double odometry_sigma = 0.01;        ///< m/√s
  double odometry_angle_sigma = 6e-4;  ///< rad/√s
  double odometry_scale = 0.0;         ///< odometry measures (1 + odometry_scale) times the true translation
  double odometry_yaw_drift = 0.0;     ///< rad/s
};

/// Simulated measurements of a docking with the truth.
struct SimulatedDocking {
  TrackingData data;
  std::vector<Stamped<SE3>> truth_chaser, truth_target;  ///< 10 Hz, as the odometry
  std::vector<std::pair<double, double>> gaps;           ///< start and end of each gap [s]
};

/// Returns the sensors that observe the target, "usbl" and "optical", without measurements.
std::vector<TargetSensor> docking_sensors(const DockingOptions& options);

/// Simulates a docking like the built-in scenario docking_a. The defaults give its noise and this motion: a surface
/// vessel on a lawn-mower course, and a chaser at 3 m depth whose distance varies between 40 m and 6 m. Odometry
/// drifts. A USBL fix comes every 4.2 s above 9 m distance, an optical pose every 0.5 s below, with random blind
/// spells. The stated sigmas are those of the noise; they do not cover outliers, odometry scale and yaw drift. Results
/// are reproducible. Throws Error if an option is out of range.
SimulatedDocking simulate_docking(const DockingOptions& options = {});

}  // namespace tandem
