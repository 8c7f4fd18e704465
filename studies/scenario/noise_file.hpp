#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

/// Standard deviations by name, in the axes and units of scenario.yaml.
struct NoiseEntry {
  std::string name;  ///< of a sensor, or of another entry of a scenario's noise
  std::vector<double> sigmas;
};

/// What `tandem calibrate --out` writes and `--noise-from` reads: a yaml file whose one key, `noise`, holds standard
/// deviations as a scenario's does, those of sensors under the sensors' names, and numbers of sensors (SensorNumber).
/// Throws Error naming file and line.
std::vector<NoiseEntry> read_noise_file(const std::filesystem::path& file);
/// The same as text, under a comment of whole lines.
std::string noise_file_text(const std::vector<NoiseEntry>& entries, const std::string& comment);

}  // namespace tandem
