#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/scenario.hpp>

#include "paths.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::EndsWith;

const std::filesystem::path kScenarios = std::filesystem::path(paths::source) / "share" / "scenarios";

TEST(BuiltinScenarios, CanBeRead) {
  const auto names = scenario_names(kScenarios);
  EXPECT_THAT(names, testing::Contains("docking_a"));
  for (const std::string& name : names) {
    const Scenario scenario = read_scenario(find_scenario(name, kScenarios));
    EXPECT_EQ(scenario.name, name);
    EXPECT_FALSE(scenario.description.empty());
  }
}

TEST(BuiltinScenarios, FolderTakesPrecedence) {
  const ScratchFolder folder;
  EXPECT_EQ(find_scenario(folder.path().string(), kScenarios), folder.path());
}

TEST(BuiltinScenarios, UnknownNameListsKnownNames) {
  EXPECT_EQ(error_of([] { find_scenario("docking_b", kScenarios); }),
            "there is no folder 'docking_b' and no built-in scenario of that name; did you mean docking_a? "
            "(built in: docking_a)");
  EXPECT_THAT(error_of([] { find_scenario("x", "/nonexistent"); }), EndsWith("(built in: none)"));
}

TEST(BuiltinScenarios, RejectsFile) {
  const ScratchFolder folder;
  folder.write("scenario.yaml", "");
  EXPECT_THAT(error_of([&] { find_scenario((folder.path() / "scenario.yaml").string(), kScenarios); }),
              EndsWith("is a file; give the folder that contains scenario.yaml"));
}

}  // namespace
}  // namespace tandem
