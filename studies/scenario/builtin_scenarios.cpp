#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/support/installation.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

std::filesystem::path builtin_scenarios() { return share_folder() / "scenarios"; }

std::vector<std::string> scenario_names(const std::filesystem::path& scenarios) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(scenarios, error))
    if (std::filesystem::exists(entry.path() / "scenario.yaml")) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::filesystem::path find_scenario(const std::string& folder_or_name, const std::filesystem::path& scenarios) {
  if (std::filesystem::is_directory(folder_or_name)) return folder_or_name;
  if (std::filesystem::exists(folder_or_name))
    throw Error(fmt::format("{} is a file; give the folder that contains scenario.yaml", quote(folder_or_name)));
  const std::vector<std::string> names = scenario_names(scenarios);
  if (std::find(names.begin(), names.end(), folder_or_name) != names.end()) return scenarios / folder_or_name;
  throw Error(fmt::format("there is no folder {} and no built-in scenario of that name{} (built in: {})",
                          quote(folder_or_name), did_you_mean(folder_or_name, names),
                          names.empty() ? "none" : listed(names)));
}

}  // namespace tandem
