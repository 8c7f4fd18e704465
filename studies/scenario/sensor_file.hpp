#pragma once

#include <filesystem>

#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// Whether an entry's `file:` may be outside of the scenario's folder: not, unless this program was told so.
void allow_outside_files(bool allowed);

/// Where the rows of a sensor are, by its key `file`. Throws Error, naming file and line, when that leads out of `folder`
/// and may not.
std::filesystem::path sensor_file(const YamlSection& sensor, const std::filesystem::path& folder);

}  // namespace tandem
