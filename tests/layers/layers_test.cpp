#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "paths.hpp"
#include "studies/scratch.hpp"

/// Checks that includes follow the dependency order of folders, and that file names are unique within the project.
namespace tandem {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Dependencies of each folder. A folder may include its direct and indirect dependencies only.
const std::map<std::string, std::vector<std::string>> kDependencies = {
    {"lie", {}},
    {"residuals", {"lie"}},
    {"residuals/vehicle", {"residuals"}},
    {"problem", {"residuals"}},
    {"problem/file", {"problem"}},
    {"problem/navigation", {"problem"}},
    {"problem/tracking", {"problem/navigation"}},
    {"problem/planning", {"problem", "residuals/vehicle"}},
    {"solvers/linear", {"problem"}},
    {"solvers", {"solvers/linear"}},
    {"solvers/calibration", {"solvers"}},
    {"solvers/fixed_lag", {"solvers"}},
    {"solvers/online", {"solvers/fixed_lag", "problem/tracking"}},
    {"solvers/replanning", {"solvers", "problem/planning"}},
    {"solvers/heading_search", {"solvers", "problem/tracking"}},
    {"studies/support", {"solvers", "problem/tracking"}},
    {"studies/scenario", {"studies/support"}},
    {"studies/simulation", {"studies/scenario"}},
    {"studies/fit", {"studies/scenario"}},
    {"studies/navigation", {"studies/fit", "solvers/online", "solvers/heading_search"}},
    {"studies/navigation_results", {"studies/navigation"}},
    {"studies/estimation", {"studies/navigation"}},
    {"studies/calibration", {"studies/navigation", "solvers/calibration"}},
    {"studies/tuning", {"studies/calibration", "studies/estimation"}},
    {"studies/online", {"studies/estimation"}},
    {"studies/comparison", {"studies/estimation", "studies/calibration"}},
    {"studies/planning", {"studies/estimation", "studies/simulation", "solvers/replanning"}},
    {"studies/rendezvous", {"studies/planning"}},
    {"studies/study", {"studies/comparison", "studies/calibration", "studies/rendezvous"}},
    {"studies/paper", {"studies/study"}},
    {"studies/report", {"studies/study", "studies/navigation_results", "studies/tuning"}},
    {"studies/recording", {"studies/support"}},
    {"studies/inspection", {"studies/recording", "studies/scenario"}},
    {"studies/import", {"studies/inspection"}},
    {"studies/export", {"studies/import"}},
    {"studies/commands", {"studies/export", "studies/online", "studies/report", "studies/paper", "problem/file"}},
    {"studies/bench", {"studies/commands"}},
};
const std::vector<std::string> kLayers = {"lie", "residuals", "problem", "solvers", "studies"};
/// File names that each library may have, for its users.
const std::set<std::string> kRepeatedNames = {"testing"};

void add_dependencies(const std::string& folder, std::set<std::string>& all) {
  all.insert(folder);
  for (const std::string& dependency : kDependencies.at(folder)) add_dependencies(dependency, all);
}

/// Returns a message for each violation in the tree below `root`, in the order of files.
std::vector<std::string> violations(const std::filesystem::path& root) {
  std::vector<std::filesystem::path> sources;
  for (const std::string& layer : kLayers) {
    if (!std::filesystem::exists(root / layer)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / layer))
      if (const auto extension = entry.path().extension(); extension == ".hpp" || extension == ".cpp")
        sources.push_back(std::filesystem::relative(entry.path(), root));
  }
  std::sort(sources.begin(), sources.end());

  std::vector<std::string> found;
  std::map<std::string, std::filesystem::path> folder_of;  // by the name without its extension
  const std::regex include("\\s*#\\s*include\\s*([<\"])(.*)[>\"].*");
  for (const auto& source : sources) {
    const std::string folder = source.parent_path().string(), name = source.stem().string();
    const auto [first, inserted] = folder_of.emplace(name, source.parent_path());
    if (!inserted && first->second != source.parent_path() && !kRepeatedNames.contains(name))
      found.push_back(source.string() + ": " + first->second.string() + " has a file of the same name");
    if (!kDependencies.contains(folder)) {
      found.push_back(source.string() + ": layers_test.cpp does not list the folder " + folder);
      continue;
    }
    std::set<std::string> allowed{""};  // the generated <tandem/version.hpp>
    add_dependencies(folder, allowed);
    const auto header = std::filesystem::path(source).replace_extension(".hpp");
    bool reads_header = source.extension() == ".hpp" || !std::filesystem::exists(root / header);

    std::ifstream lines(root / source);
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      std::smatch match;
      if (!std::regex_match(line, match, include)) continue;
      std::filesystem::path included(match[2].str());
      const std::string where = source.string() + ":" + std::to_string(number) + ": ";
      if (*included.begin() != "tandem") {
        // Tandem's headers are included as <tandem/…>, except in benchmarks.
        if (match[1] == "\"" && folder != "studies/bench")
          found.push_back(where + "include it as <tandem/" + folder + "/" + included.string() + ">");
        continue;
      }
      included = std::filesystem::relative(included, "tandem");
      reads_header = reads_header || included == header;
      if (!allowed.contains(included.parent_path().string()))
        found.push_back(where + folder + " must not include " + included.string());
    }
    if (!reads_header) found.push_back(source.string() + ": does not include " + header.string());
  }
  return found;
}

TEST(Layers, IncludesFollowTheDependencyOrder) { EXPECT_THAT(violations(paths::source), IsEmpty()); }

TEST(Layers, ReportsViolationsWithFileAndLine) {
  const ScratchFolder scratch;
  for (const char* folder : {"lie", "residuals", "problem/tracking", "solvers", "studies/odd"})
    std::filesystem::create_directories(scratch.path() / folder);
  scratch.write("lie/so3.hpp", "#pragma once\n");
  scratch.write("lie/testing.hpp", "#pragma once\n");
  scratch.write("residuals/testing.hpp", "#include <tandem/lie/testing.hpp>\n#include <vector>\n");
  scratch.write("residuals/prior.hpp", "#include <tandem/lie/so3.hpp>\n\n#include <tandem/problem/problem.hpp>\n");
  scratch.write("problem/tracking/prior.hpp", "#include <tandem/residuals/prior.hpp>\n");
  scratch.write("solvers/nlopt.hpp", "#include <tandem/solvers/linear/front.hpp>\n");
  scratch.write("solvers/nlopt.cpp",
                "// no header\n#include \"nlopt.hpp\"\n#include <tandem/problem/tracking/prior.hpp>\n");
  scratch.write("studies/odd/odd.hpp", "");
  EXPECT_THAT(violations(scratch.path()),
              ElementsAre("residuals/prior.hpp: problem/tracking has a file of the same name",
                          "residuals/prior.hpp:3: residuals must not include problem/problem.hpp",
                          "solvers/nlopt.cpp:2: include it as <tandem/solvers/nlopt.hpp>",
                          "solvers/nlopt.cpp:3: solvers must not include problem/tracking/prior.hpp",
                          "solvers/nlopt.cpp: does not include solvers/nlopt.hpp",
                          "studies/odd/odd.hpp: layers_test.cpp does not list the folder studies/odd"));
}

}  // namespace
}  // namespace tandem
