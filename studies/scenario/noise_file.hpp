#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

/// Standard deviations by name, in the axes and units of scenario.yaml.
struct NoiseEntry {
  std::string name;  ///< a sensor, another entry of `noise:` in scenario.yaml, or a SensorParameter
  std::vector<double> sigmas;
};

/// Reads a noise file, which `tandem calibrate` writes. Its only key `noise` has the format of the section
/// `noise` of scenario.yaml. It contains standard deviations by name and SensorParameter values. Throws Error with file
/// and line.
std::vector<NoiseEntry> read_noise_file(const std::filesystem::path& file);
/// Returns the text of a noise file. Each line of `comment` becomes a comment line at its start.
std::string noise_file_text(const std::vector<NoiseEntry>& entries, const std::string& comment);

}  // namespace tandem
