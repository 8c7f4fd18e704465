#pragma once

namespace tandem {

/// An entry of scenario.yaml that is written if the map does not give it.
struct DefaultNoise {
  const char* name;
  const char* values;
  const char* comment;
};
/// Noise of scenarios with a target, if the map does not give it.
inline constexpr DefaultNoise kDefaultNoise[] = {
    {"prior", "[0.001, 0.001, 0.001, 0.001, 0.001, 0.001]", "first pose of the chaser [m, rad]"},
    {"odometry", "[0.03, 0.03, 0.03, 0.002, 0.002, 0.002]", "random walk of the odometry, per sqrt(s)"},
    {"constant_twist", "[0.15, 0.05, 0.05, 0.02, 0.02, 0.06]", "change of the target's motion, per sqrt(s)"},
    {"roll_pitch", "[0.05, 0.05]", "roll and pitch of the target [rad]"},
    {"constant_velocity", "[0.15, 0.15, 0.05]", "as constant_twist, for points (mode B)"},
    {"boundary", "[0.001, 0.001, 0.001]", "boundary residuals of mode B [m]"}};

/// Noise of an IMU of the MEMS grade.
inline constexpr DefaultNoise kDefaultImuNoise[] = {{"accelerometer", "2.0e-3", "m/s^2/sqrt(Hz)"},
                                                    {"gyroscope", "2.0e-4", "rad/s/sqrt(Hz)"},
                                                    {"accelerometer_bias_walk", "1.0e-4", ""},
                                                    {"gyroscope_bias_walk", "1.0e-5", ""}};

}  // namespace tandem
