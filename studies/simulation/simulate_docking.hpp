#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// How a simulated target moves, at its speed. A vessel sails on a circuit, a straight line or a circle: no sway. A
/// free vehicle goes down along a helix, nose along its path, or hovers.
enum class TargetMotion { circuit, straight, circle, helix, hover };

/// A position along the axes of the chaser's body, or range and bearings, whose errors across grow with the distance.
enum class UsblKind { position, range_bearing };

/// What is simulated. docking_parameters.hpp has names, units and limits of these.
struct DockingOptions {
  double minutes = 20;
  std::uint64_t seed = 1;
  double keyframe_interval = 1.0;  ///< s, as a scenario says it

  TargetMotion motion = TargetMotion::circuit;
  bool planar = false;        ///< chaser and target on the water's plane: the problem is that of SE(2)
  double speed = 1.0;         ///< m/s
  double turn_radius = 35.0;  ///< m
  double weave = 0.0;   ///< m: how far the target swings to either side of its course, each 60 s; its heading follows
  double waves = 0.03;  ///< rad: roll and pitch
  double far = 40.0, near = 5.5;  ///< m: how far the chaser falls back, and how near it comes
  double approach = 240.0;        ///< s: from one approach to the next

  UsblKind usbl = UsblKind::position;
  double usbl_period = 4.2;              ///< s
  double usbl_sigma = 1.72;              ///< m: of each axis, or of the range
  double usbl_bearing_sigma = 0.04;      ///< rad: of range_bearing
  double usbl_outliers = 0.0;            ///< share of the fixes
  double usbl_outlier_sigma = 30.0;      ///< m: of each axis, in place of usbl_sigma
  double usbl_latency = 0.0;             ///< s: how late a fix is stamped, which a scenario tells as its delay
  double optical_period = 0.5;           ///< s
  double optical_sigma = 0.137;          ///< m
  double optical_angle_sigma = 0.04;     ///< rad
  double optical_range = 9.0;            ///< m: within, optical poses; beyond, USBL fixes
  double optical_view = 360.0;           ///< deg: the whole angle of the cone of view, about the chaser's bow
  double blind = 0.2;                    ///< share of the spells in which a sensor sees nothing
  double spell = 60.0;                   ///< s
  double gap = 0.0, gap_period = 120.0;  ///< s: neither sensor sees anything for so long, once in each period

  double odometry_sigma = 0.01;        ///< m/√s
  double odometry_angle_sigma = 6e-4;  ///< rad/√s
  double odometry_scale = 0.0;         ///< odometry reads (1 + this) times the way made
  double odometry_yaw_drift = 0.0;     ///< rad/s
};

struct SimulatedDocking {
  TrackingData data;
  std::vector<Stamped<SE3>> truth_chaser, truth_target;  ///< 10 Hz, as the odometry
  std::vector<std::pair<double, double>> gaps;           ///< s: from, to, of `gap`
};

/// A rendezvous as in the built-in docking_a, of any length: a surface vessel on a course like a lawn mower's, and a
/// chaser 3 m deep that falls back, some 40 m, and comes up to 6 m again. The chaser's odometry drifts; it has a USBL
/// fix every 4 s or so while it is farther than 9 m, and an optical pose every 0.5 s while it is nearer; of either
/// now and then nothing for a while. Noises are docking_a's. All that by default; the options say otherwise. The
/// scenario's sigmas are those of the noise, but that they know of no outlier, scale or drift. The same options give
/// the same numbers. Throws Error on options out of range.
SimulatedDocking simulate_docking(const DockingOptions& options = {});

}  // namespace tandem
