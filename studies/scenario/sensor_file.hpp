#pragma once

#include <filesystem>

#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// Sets whether a sensor's `file:` may be outside the scenario folder. The default is false.
void allow_outside_files(bool allowed);

/// Returns the path of a sensor's file from its key `file`, relative to `folder`. Throws Error with file and line if it
/// is outside `folder` and allow_outside_files() was not set.
std::filesystem::path sensor_file(const YamlSection& sensor, const std::filesystem::path& folder);

}  // namespace tandem
