#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

/// Returns the names of the built-in studies (share/tandem/studies/NAME.yaml), sorted.
std::vector<std::string> builtin_studies();

/// Returns the study file for a path or the name of a built-in study. Throws Error that suggests the nearest name if
/// there is neither.
std::filesystem::path study_file(const std::string& path_or_name);

}  // namespace tandem
