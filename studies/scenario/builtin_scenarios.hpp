#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

/// Returns the folder of the built-in scenarios, share/tandem/scenarios.
std::filesystem::path builtin_scenarios();

/// Returns the names of the scenarios in the folder `scenarios`, in alphabetical order. Returns none if the folder does
/// not exist.
std::vector<std::string> scenario_names(const std::filesystem::path& scenarios);

/// Returns the folder of a scenario, given its path or the name of a scenario in the folder `scenarios`. If there is
/// none, throws Error with the list of names.
std::filesystem::path find_scenario(const std::string& folder_or_name, const std::filesystem::path& scenarios);

}  // namespace tandem
