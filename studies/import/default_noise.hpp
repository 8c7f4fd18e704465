#pragma once

#include <vector>

#include <tandem/studies/import/import.hpp>

namespace tandem {

/// An entry of scenario.yaml that is written if the map does not give it.
struct DefaultNoise {
  const char* name;
  const char* values;
  const char* comment;
};
/// Returns whether scenario.yaml has the section noise: with odometry, with a sensor of the target, or if the map has it.
bool has_noise(const Import& import);
/// Returns the noise of a scenario that the map does not give. Without odometry, the entries `prior` and
/// `odometry` are omitted.
std::vector<DefaultNoise> missing_noise(const Import& import);
/// Returns the noise of an IMU that its entry does not give, of the MEMS grade.
std::vector<DefaultNoise> missing_imu_noise(const ImportSensor& sensor);

}  // namespace tandem
