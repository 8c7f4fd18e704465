#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "paths.hpp"
#include "studies/commands/run_here.hpp"
#include "studies/scratch.hpp"

namespace tandem {

Command sensors_command();

namespace {

using testing::HasSubstr;

RunHere run(const std::vector<std::string>& words) { return run_here(sensors_command().prepare, words); }

TEST(Extending, NewCommandCountsMeasurements) {
  const ScratchFolder scenario, scratch;
  write_small_scenario(scenario);
  const std::string folder = scenario.path().string(), out = (scratch.path() / "out").string();
  EXPECT_EQ(run({folder}).output, "sensor,measurements\nusbl,2\noptical,2\n");
  EXPECT_EQ(run({folder, "--without", "optical", "--out", out}).output,
            "sensor,measurements\nusbl,2\n\nWritten to " + out + "\n");
  EXPECT_EQ(read_file(out + "/sensors.csv"), "sensor,measurements\nusbl,2\n");
  EXPECT_EQ(run({folder, "--least", "3"}).output, "sensor,measurements\n");
}

TEST(Extending, NewCommandReportsInvalidOptions) {
  EXPECT_EQ(run({"docking_a", "--least", "0"}).errors, "tandem: --least takes a positive integer, not '0'\n");
  EXPECT_THAT(run({"docking_a", "--leest", "1"}).errors, HasSubstr("did you mean --least?"));
  EXPECT_EQ(run({}).status, kInvalidInput);
  const RunHere help = run({"--help-all"});
  EXPECT_EQ(help.status, kSuccess);
  for (const char* text : {"Table:", "--least", "Sensors:", "--without", "Output:", "--out"})
    EXPECT_THAT(help.output, HasSubstr(text));
}

/// The page quotes the file that is compiled here.
TEST(Extending, PageQuotesTheNewCommand) {
  const std::string document = read_file(std::filesystem::path(paths::source) / "docs/contributing.md");
  const std::string source = read_file(std::filesystem::path(paths::source) / "tests/extending/sensors_command.cpp");
  const std::string code = source.substr(source.find("#include"));
  EXPECT_THAT(document, HasSubstr("```cpp\n" + code + "```\n"));
}

}  // namespace
}  // namespace tandem
