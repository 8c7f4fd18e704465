#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;
using OrderedJson = nlohmann::ordered_json;

/// Runs a command with --out, repeats it from its run file, and expects the same contents of `names`.
void expect_repeatable(std::vector<std::string> words, const std::vector<std::string>& names) {
  const ScratchFolder scratch;
  const std::string a = scratch.path() / "a", b = scratch.path() / "b";
  words.insert(words.end(), {"--out", a, "--quiet"});
  const Outcome first = run_tandem(words);
  ASSERT_EQ(first.status, 0) << first.errors;
  const Outcome second = run_tandem({words[0], "--config", a + "/run.yaml", "--out", b});
  ASSERT_EQ(second.status, 0) << second.errors << read_file(a + "/run.yaml");
  EXPECT_EQ(second.output, "") << "quiet, too";
  EXPECT_EQ(read_file(a + "/run.yaml"), read_file(b + "/run.yaml"));
  for (const std::string& name : names) {
    EXPECT_NE(read_file(a + "/" + name), "") << name;
    EXPECT_EQ(read_file(a + "/" + name), read_file(b + "/" + name)) << name;
  }
}

TEST(RunFile, RepeatsEstimate) {
  expect_repeatable({"estimate", "docking_a", "--max-keyframes", "60", "--mode", "B", "--surge=-1,2.5", "--noise",
                     "usbl=3,3,3", "--noise", "optical=0.1,0.1,0.1,0.05,0.05,0.05", "--loss", "usbl=cauchy:2",
                     "--roll-pitch", "off", "--plots", "off"},
                    {"target.tum", "target_full.csv", "errors.csv"});
}

TEST(RunFile, RepeatsTrack) {
  expect_repeatable({"track", "docking_a", "--until", "60", "--predict", "2,4", "--gate", "off", "--plots", "off"},
                    {"chaser.tum", "target.tum", "errors.csv"});
}

TEST(RunFile, RepeatsPlan) {
  expect_repeatable({"plan", "docking_a", "--at", "60", "--horizon", "5", "--goal=-6,0,-3.4", "--plots", "off"},
                    {"planned_chaser.csv", "commands.csv"});
}

TEST(RunFile, RepeatsStudy) {
  const ScratchFolder scratch;
  scratch.write("small.yaml",
                "name: small\nquestion: Does it run?\nparameters: {minutes: 1}\n"
                "models: [constant-twist]\nseeds: 2\n");
  expect_repeatable({"study", "run", scratch.path() / "small.yaml", "--threads", "1"}, {"tables.txt", "summary.csv"});
}

TEST(RunFile, CommandLineReplacesValues) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("run.yaml",
                                         "command: estimate\nscenario: docking_a\nmax-keyframes: 40\n"
                                         "noise: [\"usbl=3,3,3\", \"usbl=4,4,4\"]\nsurge: [0, 2.5]\nrobust: false\n"
                                         "json: true\n");
  const auto json = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"estimate", "--config", file});
    const Outcome run = run_tandem(words);
    EXPECT_EQ(run.status, 0) << run.errors;
    return OrderedJson::parse(run.output);
  };
  const OrderedJson plain = OrderedJson::parse(run_tandem({"estimate", "docking_a", "--max-keyframes", "40", "--noise",
                                                           "usbl=4,4,4", "--surge", "0,2.5", "--json"})
                                                   .output);
  EXPECT_EQ(json({})["cost"], plain["cost"]);
  EXPECT_EQ(json({"--max-keyframes", "30"})["keyframes"], 30);
  EXPECT_EQ(json({"docking_a"})["cost"], plain["cost"]);
  EXPECT_NE(json({"--noise", "usbl=9,9,9"})["cost"], plain["cost"]);
}

TEST(RunFile, PrintsPresentOptions) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  const Outcome run = run_tandem({"estimate", scratch.path(), "--surge=-1,2", "--robust", "--loss", "usbl=off", "-o",
                                  scratch.path() / "out", "--print-config"});
  EXPECT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(run.output, ContainsRegex("^# Written by tandem [^\n]+\\. To repeat this run: tandem estimate --config "
                                        "run.yaml --out DIR\ncommand: estimate\n"));
  EXPECT_THAT(run.output, HasSubstr("\nscenario: " + scratch.path().string() + "\n"));
  EXPECT_THAT(run.output, HasSubstr("\nsurge: \"-1,2\"\n"));
  EXPECT_THAT(run.output, HasSubstr("\nrobust: true\n"));
  EXPECT_THAT(run.output, HasSubstr("\nloss: [\"usbl=off\"]\n"));
  EXPECT_THAT(run.output, Not(HasSubstr("out:")));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "out"));
}

/// Each message is one sentence with file and line.
TEST(RunFile, RejectsInvalidFiles) {
  const ScratchFolder scratch;
  const auto error = [&](const std::string& text) {
    return rejection({"estimate", "--config", scratch.write("run.yaml", text)});
  };
  EXPECT_THAT(error("command: estimate\nscenario: docking_a\nsolvr: ipopt\n"),
              HasSubstr("run.yaml:3: unknown key 'solvr'; did you mean solver?"));
  EXPECT_THAT(error("command: track\nscenario: docking_a\n"),
              HasSubstr("run.yaml:1: this run file is for tandem track, not for tandem estimate"));
  EXPECT_THAT(error("scenario: docking_a\nmode: C\n"), ContainsRegex("run.yaml:2: --mode takes A or B, not 'C'"));
  EXPECT_THAT(error("scenario: docking_a\nnoise: [\"usbl=2,2,2\", \"usbl\"]\n"), HasSubstr("run.yaml:2: --noise"));
  EXPECT_THAT(error("scenario: docking_a\nrobust: maybe\n"), HasSubstr("run.yaml:2: robust must be true or false"));
  EXPECT_THAT(error("scenario: docking_a\nnoise: {usbl: [1, 1, 1]}\n"), HasSubstr("run.yaml:2: noise must be text"));
  EXPECT_THAT(error("scenario: docking_a\nmode: A\nmode: B\n"), HasSubstr("run.yaml:3: key 'mode' is given twice"));
  EXPECT_THAT(error("scenario: [docking_a\n"), HasSubstr("not valid yaml"));
  EXPECT_THAT(error("config: other.yaml\n"), HasSubstr("run.yaml:1: unknown key 'config'"));
  EXPECT_THAT(error("mode: A\n"), HasSubstr("scenario is required"));
  EXPECT_THAT(rejection({"estimate", "--config", scratch.path() / "missing.yaml"}),
              HasSubstr("missing.yaml: there is no such file"));
  EXPECT_THAT(rejection_as_given({"estimate", "docking_a", "--config"}), HasSubstr("--config needs a value"));
}

}  // namespace
}  // namespace tandem
