#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// Classes of sensors, by figures typical of them (Groves 2013, "Principles of GNSS, Inertial, and Multisensor
/// Integrated Navigation Systems", table 4.1 and section 4.4; IEEE Std 952 for what they mean): micromechanical ones as
/// in small vehicles, and tactical ones with fibre-optic gyroscopes.
enum class Grade { mems, tactical };
std::string_view name(Grade grade);

/// Standard deviations and spectral densities of a vehicle's sensors.
struct DiveSensors {
  ImuNoise imu;
  double initial_accelerometer_bias, initial_gyroscope_bias;  ///< m/s², rad/s
  double dvl;                                                 ///< m/s
  double dvl_scale;                                           ///< of the scale factor's error, which is constant
  double depth;                                               ///< m
  double roll_pitch, heading;                                 ///< rad
  double gps = 1.0, gps_height = 2.0;                         ///< m

  static DiveSensors of(Grade grade);
};

/// dive_parameters.hpp has names, units and limits of these.
struct DiveOptions {
  Grade grade = Grade::mems;
  double minutes = 20;
  std::uint64_t seed = 1;
  double latitude = 60;  ///< deg
  double keyframe_interval = 1.0;
  int surfacings = 0;     ///< on the way; each gives GPS for some 70 s
  bool noise = true;      ///< false: sensors without noise, biases or scale factor error, their stated σ the same
  bool dvl_scale = true;  ///< false: the DVL's scale is right
  double dvl_outage = 0.0, dvl_outage_period = 240.0;  ///< s: without bottom in sight for so long, once in each period

  bool target = false;       ///< a surface vessel that the vehicle fixes by USBL
  double usbl_period = 2.0;  ///< s
  double usbl_sigma = 0.5;   ///< m: of each axis of a fix
};

struct SimulatedDive {
  NavigationData data;
  std::vector<Stamped<SE23>> truth;                    ///< 10 Hz: pose and velocity in the world
  std::vector<Stamped<Vector<6>>> biases;              ///< of the IMU, [accelerometer; gyroscope], 10 Hz
  double dvl_scale_error = 0;                          ///< the DVL reads (1 + this) v
  std::vector<std::pair<double, double>> dvl_outages;  ///< s: from, to

  TrackingData tracking;                   ///< of the target: its fixes and noise; no odometry
  std::vector<Stamped<SE3>> truth_target;  ///< 10 Hz; empty without a target
};

/// A vehicle's survey dive (see DiveMotion) and what its own sensors read: IMU 100 Hz, DVL 5 Hz, depth 10 Hz, heading
/// 2 Hz, GPS 1 Hz at the surface. The IMU's readings are exact for the motion on a turning Earth before noise is added,
///
///   f = R_bsᵀ (Rᵀ (a + 2 Ω × v − g) + ω̇ × l + ω × (ω × l) + 2 RᵀΩ × (ω × l)) + b_a      w = R_bsᵀ (ω + RᵀΩ) + b_g
///
/// with ω of the body against the world, Ω the Earth's rate, l the IMU's lever arm. A target is a surface vessel at 1.3 m/s on
/// a circle of 130 m about the survey. The same options give the same numbers, and the chaser's sensors the same with a
/// target and without. Throws Error on options out of range.
SimulatedDive simulate_dive(const DiveOptions& options = {});

}  // namespace tandem
