#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

class BadScenario : public testing::Test {
 protected:
  BadScenario() { write_small_scenario(folder_); }
  std::string estimate_error() { return rejection({"estimate", folder_.path().string()}); }

  ScratchFolder folder_;
};

TEST_F(BadScenario, UnchangedScenarioIsEstimated) {
  const Outcome run = run_tandem({"estimate", folder_.path().string(), "--json"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_NEAR(Json::parse(run.output)["cost"], 0.0, 1e-9);
}

TEST_F(BadScenario, ErrorsInFilesNameFileAndLine) {
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0\n");
  EXPECT_THAT(estimate_error(), HasSubstr("usbl.csv:2: expected 4 columns"));
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,zero\n");
  EXPECT_THAT(estimate_error(), HasSubstr("usbl.csv:2: z is 'zero', not a number"));
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,inf\n");
  EXPECT_THAT(estimate_error(), HasSubstr("usbl.csv:2: z is inf; numbers must be finite"));
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,0\n1,5,0,0\n");
  EXPECT_THAT(estimate_error(), HasSubstr("usbl.csv:3: time 1 repeats that of line 2"));
  folder_.write("usbl.csv", "t,x,y,z\n6,5,0,0\n");
  EXPECT_THAT(estimate_error(), HasSubstr("usbl.csv:2: time 6 is outside the time span of the odometry"));
  folder_.write("usbl.csv", "t,x,y,z\n");
  folder_.write("optical.csv", "t,x,y,z,qx,qy,qz,qw\n2,5,0,0,0,0,0,0.5\n");
  EXPECT_THAT(estimate_error(), HasSubstr("optical.csv:2: quaternion 0 0 0 0.5 has norm 0.5"));
  folder_.write("optical.csv", "t,x,y,z,qx,qy,qz,qw\n");
  EXPECT_THAT(estimate_error(), HasSubstr("has no measurements"));
}

TEST_F(BadScenario, EscapesControlCharactersInErrors) {
  folder_.write("usbl.csv",
                "\x1b]0;title\x07\x9b"
                "2J\xff\n");
  const std::string errors = estimate_error();
  EXPECT_THAT(errors, HasSubstr("'\\x1b]0;title\\x07\\x9b2J\\xff'"));
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,\x1b[2J\n");
  EXPECT_THAT(estimate_error(), HasSubstr("z is '\\x1b[2J', not a number"));
  const std::string named = folder_.path() / "a\x1b[2Jb";
  EXPECT_THAT(rejection({"estimate", named}), HasSubstr("a\\x1b[2Jb"));
  std::filesystem::create_directory(named);
  EXPECT_THAT(rejection({"estimate", named}), HasSubstr("a\\x1b[2Jb")) << "in a message that does not quote the name";
}

TEST_F(BadScenario, ErrorsInYamlNameFileAndLine) {
  const std::string yaml = read_file(folder_.path() / "scenario.yaml");
  folder_.write("scenario.yaml", yaml + "keyframe_intervals: 2\n");
  EXPECT_THAT(estimate_error(),
              HasSubstr("scenario.yaml:11: unknown key 'keyframe_intervals'; did you mean keyframe_interval?"));
  folder_.write("scenario.yaml", yaml + "  roll_pitch: [0.1, 0]\n");
  EXPECT_THAT(estimate_error(), HasSubstr("scenario.yaml:11: roll_pitch has the standard deviation 0;"));
  std::filesystem::remove(folder_.path() / "scenario.yaml");
  EXPECT_THAT(estimate_error(), HasSubstr("scenario.yaml is missing"));
}

TEST(CommandLine, ReadsFilesOutsideFolderOnlyIfAllowed) {
  const ScratchFolder scratch;
  std::filesystem::create_directory(scratch.path() / "inner");
  const auto yaml = scratch.path() / "inner" / "scenario.yaml";
  for (const char* file : {"../sonar.csv", "/etc/passwd", "a/../../sonar.csv"}) {
    std::ofstream(yaml) << "name: x\nnoise: {prior: [1, 1, 1, 1, 1, 1]}\nsensors: {sonar: {type: range, file: " << file
                        << ", sigma: 1}}\n";
    const std::string why = rejection_as_given({"track", yaml.parent_path(), "--stdin"});
    EXPECT_THAT(why, HasSubstr("is outside the scenario folder; use --allow-outside to read it"));
    EXPECT_THAT(why, testing::Not(HasSubstr("root:")));
    EXPECT_THAT(run_tandem({"track", yaml.parent_path(), "--stdin", "--allow-outside"}).errors,
                testing::Not(HasSubstr("is outside")));
  }
}

TEST(CommandLine, EscapesControlCharactersInResults) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  std::string yaml = read_file(scratch.path() / "scenario.yaml");
  yaml.replace(yaml.find("small"), 5, "\"\\e]0;x\\a\\e[2J\"");
  scratch.write("scenario.yaml", yaml);
  for (const char* command : {"estimate", "track"}) {
    const auto out = scratch.path() / "\x1b[2J";
    const Outcome run = run_tandem({command, scratch.path(), "--out", out, "--plots", "off"});
    EXPECT_EQ(run.status, 0) << run.errors;
    EXPECT_THAT(run.output, HasSubstr("\\x1b]0;x\\x07\\x1b[2J"));
    for (const char c : run.output + run.errors) EXPECT_FALSE(c == '\x1b' || c == '\x07');
  }
}

TEST(CommandLine, FailsIfStandardOutputIsFull) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"estimate", "docking_a", "--max-keyframes", "20"},
                                             {"estimate", "docking_a", "--max-keyframes", "20", "--json"},
                                             {"scenarios"}}) {
    const ScratchFolder scratch;
    const int error_fd = open((scratch.path() / "errors").c_str(), O_WRONLY | O_CREAT, 0600);
    EXPECT_EQ(exit_status(start_tandem(words, "/dev/full", error_fd)), 1);
    close(error_fd);
    EXPECT_THAT(read_file(scratch.path() / "errors"), HasSubstr("No space left on device"));
  }
}

}  // namespace
}  // namespace tandem
