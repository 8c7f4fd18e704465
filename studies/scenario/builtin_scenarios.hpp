#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

/// Where the executable's built-in scenarios are: share/tandem/scenarios beside its bin/.
std::filesystem::path builtin_scenarios();

/// Names of the scenarios in a folder of scenarios, in alphabetical order; empty where there is no such
/// folder.
std::vector<std::string> scenario_names(const std::filesystem::path& scenarios);

/// The folder that a user means: a path, or the name of a scenario in `scenarios`. Throws Error that lists
/// the names.
std::filesystem::path find_scenario(const std::string& folder_or_name, const std::filesystem::path& scenarios);

}  // namespace tandem
