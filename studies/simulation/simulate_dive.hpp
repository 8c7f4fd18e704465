#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// Sensor grades with typical noise: micromechanical sensors of small vehicles, and tactical ones with fibre-optic
/// gyroscopes. Source: Groves 2013, "Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems",
/// table 4.1 and section 4.4; IEEE Std 952 defines the terms.
enum class Grade { mems, tactical };
std::string_view name(Grade grade);

/// Standard deviations and spectral densities of a vehicle's sensors.
struct DiveSensors {
  ImuNoise imu;
  double initial_accelerometer_bias, initial_gyroscope_bias;  ///< m/s², rad/s
  double dvl;                                                 ///< m/s
  double dvl_scale;                                           ///< σ of the constant scale factor error
  double depth;                                               ///< m
  double roll_pitch, heading;                                 ///< rad
  double gps = 1.0, gps_height = 2.0;                         ///< m

  static DiveSensors of(Grade grade);
};

/// Options of a simulated dive. dive_parameters.hpp gives names, units and ranges.
struct DiveOptions {
  Grade grade = Grade::mems;
  double minutes = 20;
  std::uint64_t seed = 1;
  double latitude = 60;  ///< deg
  double keyframe_interval = 1.0;
  int surfacings = 0;     ///< Intermediate ascents; each gives about 70 s of GPS.
  bool noise = true;      ///< False: no noise, biases or scale factor error; the stated σ do not change.
  bool dvl_scale = true;  ///< False: no scale factor error of the DVL.
  double dvl_outage = 0.0, dvl_outage_period = 240.0;  ///< Duration and period of DVL outages (no bottom track) [s].

  bool target = false;       ///< the vehicle measures a surface vessel by USBL
  double usbl_period = 2.0;  ///< s
  double usbl_sigma = 0.5;   ///< standard deviation of a fix along each axis [m]
};

/// Simulated measurements of a dive with the truth.
struct SimulatedDive {
  NavigationData data;
  std::vector<Stamped<SE23>> truth;                    ///< pose and velocity in the world, 10 Hz
  std::vector<Stamped<Vector<6>>> biases;              ///< true IMU biases [accelerometer; gyroscope], 10 Hz
  double dvl_scale_error = 0;                          ///< the DVL measures (1 + dvl_scale_error) v
  std::vector<std::pair<double, double>> dvl_outages;  ///< start and end [s]

  TrackingData tracking;                   ///< fixes and noise of the target; no odometry
  std::vector<Stamped<SE3>> truth_target;  ///< 10 Hz; empty without a target
};

/// Simulates a survey dive (DiveMotion) and the vehicle's own sensors: IMU 100 Hz, DVL 5 Hz, depth 10 Hz, heading 2 Hz,
/// GPS 1 Hz at the surface. Before noise, the IMU samples are exact on a rotating Earth:
///
///   f = R_bsᵀ (Rᵀ (a + 2 Ω × v − g) + ω̇ × l + ω × (ω × l) + 2 RᵀΩ × (ω × l)) + b_a      w = R_bsᵀ (ω + RᵀΩ) + b_g
///
/// with the angular velocity ω of the body relative to the world, the Earth's rate Ω and the IMU's lever arm l. The
/// target is a surface vessel at 1.3 m/s on a circle with a radius of 130 m near the survey. Results are reproducible,
/// and a target does not change the chaser's measurements. Throws Error if an option is out of range.
SimulatedDive simulate_dive(const DiveOptions& options = {});

}  // namespace tandem
