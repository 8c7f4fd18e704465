#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

/// Names of the studies that are installed, share/tandem/studies/NAME.yaml, in order.
std::vector<std::string> ready_studies();

/// The file that is meant: a path, or the name of a ready study. Throws Error that names the nearest.
std::filesystem::path study_file(const std::string& path_or_name);

}  // namespace tandem
