#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/study/builtin_studies.hpp>
#include <tandem/studies/support/installation.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

std::vector<std::string> builtin_studies() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(share_folder() / "studies", none))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::filesystem::path study_file(const std::string& path_or_name) {
  if (std::filesystem::is_regular_file(path_or_name)) return path_or_name;
  const std::vector<std::string> names = builtin_studies();
  if (std::find(names.begin(), names.end(), path_or_name) != names.end())
    return share_folder() / "studies" / (path_or_name + ".yaml");
  throw Error(fmt::format("there is no study file {} and no built-in study of that name{} (there are: {})",
                          quote(path_or_name), did_you_mean(path_or_name, names), listed(names)));
}

}  // namespace tandem
