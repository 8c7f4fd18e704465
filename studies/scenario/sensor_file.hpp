#pragma once

#include <filesystem>

#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// Returns the path of a sensor's file from its key `file`, relative to `folder`. Throws Error with file and line if it
/// leads out of `folder`; see leads_outside().
std::filesystem::path sensor_file(const YamlSection& sensor, const std::filesystem::path& folder);

}  // namespace tandem
