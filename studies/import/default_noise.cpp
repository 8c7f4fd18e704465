#include <algorithm>
#include <string_view>

#include <tandem/studies/import/default_noise.hpp>

namespace tandem {
namespace {

constexpr DefaultNoise kDefaultNoise[] = {
    {"prior", "[0.001, 0.001, 0.001, 0.001, 0.001, 0.001]", "first pose of the chaser [m, rad]"},
    {"odometry", "[0.03, 0.03, 0.03, 0.002, 0.002, 0.002]", "random walk of the odometry, per sqrt(s)"},
    {"constant_twist", "[0.15, 0.05, 0.05, 0.02, 0.02, 0.06]", "change of the target's motion, per sqrt(s)"},
    {"roll_pitch", "[0.05, 0.05]", "roll and pitch of the target [rad]"},
    {"constant_velocity", "[0.15, 0.15, 0.05]", "as constant_twist, for points (mode B)"},
    {"boundary", "[0.001, 0.001, 0.001]", "boundary residuals of mode B [m]"}};

constexpr DefaultNoise kDefaultImuNoise[] = {{"accelerometer", "2.0e-3", "m/s^2/sqrt(Hz)"},
                                             {"gyroscope", "2.0e-4", "rad/s/sqrt(Hz)"},
                                             {"accelerometer_bias_walk", "1.0e-4", ""},
                                             {"gyroscope_bias_walk", "1.0e-5", ""}};

}  // namespace

bool has_noise(const Import& import) {
  return !import.map.noise.empty() || has_type(import, "odometry") ||
         std::any_of(import.sensors.begin(), import.sensors.end(),
                     [](const auto& s) { return observes_target(*s->sensor().type); });
}

std::vector<DefaultNoise> missing_noise(const Import& import) {
  const bool odometry = has_type(import, "odometry");
  std::vector<DefaultNoise> missing;
  for (const DefaultNoise& noise : kDefaultNoise) {
    const bool of_odometry = std::string_view(noise.name) == "prior" || std::string_view(noise.name) == "odometry";
    if (!has_setting(import.map.noise, noise.name) && (odometry || !of_odometry)) missing.push_back(noise);
  }
  return missing;
}

std::vector<DefaultNoise> missing_imu_noise(const ImportSensor& sensor) {
  std::vector<DefaultNoise> missing;
  for (const DefaultNoise& noise : kDefaultImuNoise)
    if (!has_setting(sensor.settings, noise.name)) missing.push_back(noise);
  return missing;
}

}  // namespace tandem
