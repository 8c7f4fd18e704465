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

/// Includes go one way, between the layers and between the folders of a layer; and a name says where a thing is.
namespace tandem {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// The order: folder by folder those right below it. A folder may include what is below it at any depth, nothing else.
const std::map<std::string, std::vector<std::string>> kBelow = {
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
    {"solvers/online", {"solvers", "problem/tracking"}},
    {"solvers/planning", {"solvers", "problem/planning"}},
    {"solvers/tracking", {"solvers", "problem/tracking"}},
    {"studies/support", {"solvers", "problem/tracking"}},
    {"studies/scenario", {"studies/support"}},
    {"studies/simulation", {"studies/scenario"}},
    {"studies/navigation", {"studies/scenario", "solvers/online", "solvers/tracking"}},
    {"studies/navigation/more", {"studies/navigation"}},
    {"studies/estimation", {"studies/navigation"}},
    {"studies/calibration", {"studies/navigation", "solvers/calibration"}},
    {"studies/live", {"studies/estimation"}},
    {"studies/comparison", {"studies/estimation"}},
    {"studies/planning", {"studies/estimation", "studies/simulation", "solvers/planning"}},
    {"studies/demo", {"studies/study"}},
    {"studies/study", {"studies/comparison", "studies/calibration", "studies/planning"}},
    {"studies/report", {"studies/study", "studies/navigation/more"}},
    {"studies/commands", {"studies/estimation", "problem/file"}},
    {"studies/commands/more", {"studies/commands", "studies/live", "studies/report", "studies/demo"}},
    {"studies/bench", {"studies/commands/more"}},
};
const std::vector<std::string> kLayers = {"lie", "residuals", "problem", "solvers", "studies"};
/// Of every library, for its users: a name that is the same on purpose.
const std::set<std::string> kOncePerLayer = {"testing"};

void add_below(const std::string& folder, std::set<std::string>& all) {
  all.insert(folder);
  for (const std::string& below : kBelow.at(folder)) add_below(below, all);
}

/// Every breach below `root`, as file:line and a sentence, in order.
std::vector<std::string> breaches(const std::filesystem::path& root) {
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
    const auto [first, unseen] = folder_of.emplace(name, source.parent_path());
    if (!unseen && first->second != source.parent_path() && !kOncePerLayer.contains(name))
      found.push_back(source.string() + ": " + first->second.string() + " has files of that name, too");
    if (!kBelow.contains(folder)) {
      found.push_back(source.string() + ": the order of folders, in layers_test.cpp, does not have " + folder);
      continue;
    }
    std::set<std::string> allowed;
    add_below(folder, allowed);
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
        // In the tree as when installed, our own headers are <tandem/…>; benchmarks alone are not.
        if (match[1] == "\"" && folder != "studies/bench")
          found.push_back(where + "spell it <tandem/" + folder + "/" + included.string() + ">");
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

TEST(Layers, IncludesGoDownAndNamesAreTold) { EXPECT_THAT(breaches(paths::source), IsEmpty()); }

TEST(Layers, ABreachIsNamedWithFileAndLine) {
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
  EXPECT_THAT(breaches(scratch.path()),
              ElementsAre("residuals/prior.hpp: problem/tracking has files of that name, too",
                          "residuals/prior.hpp:3: residuals must not include problem/problem.hpp",
                          "solvers/nlopt.cpp:2: spell it <tandem/solvers/nlopt.hpp>",
                          "solvers/nlopt.cpp:3: solvers must not include problem/tracking/prior.hpp",
                          "solvers/nlopt.cpp: does not include solvers/nlopt.hpp",
                          "studies/odd/odd.hpp: the order of folders, in layers_test.cpp, does not have studies/odd"));
}

}  // namespace
}  // namespace tandem
