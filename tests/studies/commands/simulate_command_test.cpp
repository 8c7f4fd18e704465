#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>

#include "run_tandem.hpp"
#include "shared_data.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

TEST(SimulateCommand, IsListed) {
  EXPECT_THAT(run_tandem({"--help"}).output,
              ContainsRegex("simulate +Write a made-up scenario folder: dive or docking\n"));
  EXPECT_THAT(refusal({"simulate", "div"}), HasSubstr("(there are: dive and docking)")) << "the same";
  const Outcome help = run_tandem({"simulate", "--help"});
  EXPECT_EQ(help.status, 0);
  for (const char* text : {"NAME", "--out", "--grade", "--minutes", "--seed", "--latitude", "--keyframe-interval",
                           "--surfacings", "Exit status"})
    EXPECT_THAT(help.output, HasSubstr(text));
}

TEST(SimulateCommand, WritesADive) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "dive", again = scratch.path() / "again";
  const Outcome run = run_tandem({"simulate", "dive", "--out", out, "--minutes", "2", "--grade", "tactical", "--seed",
                                  "5", "--latitude", "-45", "--keyframe-interval", "0.5"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.output, "Written to " + out.string() + "\n");
  EXPECT_EQ(run.errors, "");
  EXPECT_THAT(files(out), UnorderedElementsAre("scenario.yaml", "imu.csv", "dvl.csv", "depth.csv", "heading.csv",
                                               "gps.csv", "truth_chaser.tum", "truth_velocity.csv", "truth_bias.csv"));
  const Scenario scenario = read_scenario(out);
  EXPECT_EQ(scenario.navigation->keyframe_interval, 0.5);
  EXPECT_LT(scenario.navigation->earth.rate.z(), 0) << "the southern hemisphere";
  EXPECT_EQ(scenario.navigation->imu->samples.size(), 12'001u);
  EXPECT_EQ(scenario.navigation->imu->noise.gyroscope, DiveSensors::of(Grade::tactical).imu.gyroscope);
  ASSERT_EQ(run_tandem({"simulate", "dive", "--out", again, "--minutes", "2", "--grade", "tactical", "--seed", "5",
                        "--latitude", "-45", "--keyframe-interval", "0.5"})
                .status,
            0);
  for (const std::string& file : files(out)) EXPECT_EQ(read_file(out / file), read_file(again / file)) << file;
}

TEST(SimulateCommand, WritesADocking) {
  const ScratchFolder scratch;
  const Outcome run = run_tandem({"simulate", "docking", "--out", scratch.path(), "--minutes", "3", "--seed", "2"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("scenario.yaml", "chaser_odometry.tum", "usbl.csv",
                                                          "optical.csv", "truth_chaser.tum", "truth_target.tum"));
  const Outcome estimate = run_tandem({"estimate", scratch.path()});
  EXPECT_EQ(estimate.status, 0) << estimate.errors;
}

TEST(SimulateCommand, WritesIntoNoFolderWithSomethingInItUnlessTold) {
  const ScratchFolder scratch;
  scratch.write("scenario.yaml", "name: of the user");
  const std::vector<std::string> words = {"simulate", "dive", "--out", scratch.path(), "--minutes", "1"};
  EXPECT_THAT(refusal_as_given(words), HasSubstr("the folder is not empty; --force writes into it all the same"));
  EXPECT_EQ(read_file(scratch.path() / "scenario.yaml"), "name: of the user");
  std::vector<std::string> forced = words;
  forced.push_back("--force");
  EXPECT_EQ(run_tandem(forced).status, 0);
}

TEST(SimulateCommand, ParametersOfADocking) {
  const ScratchFolder scratch;
  const std::string settings = scratch.write("trial.yaml", "minutes: 2\nseed: 4\ngap: 20\nwaves: 0.1\n");
  const std::string a = scratch.path() / "a", b = scratch.path() / "b";
  ASSERT_EQ(run_tandem({"simulate", "docking", "--settings", settings, "--set", "waves=0.05", "--out", a}).status, 0);
  ASSERT_EQ(run_tandem({"simulate", "docking", "--minutes", "2", "--seed", "4", "--set", "gap=20", "--set",
                        "waves=0.05", "--out", b})
                .status,
            0);
  for (const std::string& file : files(a)) EXPECT_EQ(read_file(a + "/" + file), read_file(b + "/" + file)) << file;
  EXPECT_THAT(read_file(a + "/scenario.yaml"), HasSubstr("seed 4, minutes=2, waves=0.05, gap=20\n"));
}

TEST(SimulateCommand, ParametersOfADive) {
  const ScratchFolder scratch;
  ASSERT_EQ(run_tandem({"simulate", "dive", "--minutes", "2", "--set", "target=1", "--set", "grade=tactical", "--out",
                        scratch.path()})
                .status,
            0);
  EXPECT_THAT(files(scratch.path()), testing::IsSupersetOf({"usbl.csv", "truth_target.tum"}));
  const Outcome estimate = run_tandem({"estimate", scratch.path()});
  EXPECT_EQ(estimate.status, 0) << estimate.errors;
  EXPECT_THAT(estimate.output, HasSubstr("The chaser by its own sensors, together with the target"));
}

TEST(SimulateCommand, WhatIsWrongIsOneSentence) {
  const ScratchFolder scratch;
  const auto refusal = [&](std::vector<std::string> arguments, bool with_out = true) {
    arguments.insert(arguments.begin(), "simulate");
    if (with_out) arguments.insert(arguments.end(), {"--out", (scratch.path() / "out").string()});
    const Outcome run = run_tandem(arguments);
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.output, "");
    EXPECT_THAT(run.errors, ContainsRegex("^tandem: [^\n]+\n$"));
    EXPECT_TRUE(files(scratch.path()).empty());
    return run.errors;
  };
  EXPECT_THAT(refusal({"div"}),
              HasSubstr("there is no simulation 'div'; did you mean dive? (there are: dive and docking)"));
  EXPECT_THAT(refusal({}), HasSubstr("required"));
  EXPECT_THAT(refusal({"dive"}, false), HasSubstr("--out is required"));
  EXPECT_THAT(refusal({"dive", "--grade", "tactic"}), HasSubstr("--grade is mems or tactical, not 'tactic'"));
  EXPECT_THAT(refusal({"dive", "--minutes", "long"}), HasSubstr("--minutes takes a number, not 'long'"));
  EXPECT_THAT(refusal({"dive", "--minutes", "nan"}), HasSubstr("--minutes takes a number, not 'nan'"));
  EXPECT_THAT(refusal({"dive", "--minutes", "0"}), HasSubstr("takes 1 to 600 minutes, not 0"));
  EXPECT_THAT(refusal({"dive", "--seed", "-1"}), HasSubstr("--seed"));
  EXPECT_THAT(refusal({"dive", "--latitude", "100"}), HasSubstr("latitude 100 is beyond a pole"));
  EXPECT_THAT(refusal({"dive", "--minute", "3"}), HasSubstr("did you mean --minutes?"));
  EXPECT_THAT(refusal({"docking", "--grade", "mems"}), HasSubstr("simulate docking takes no --grade"));
  EXPECT_THAT(refusal({"dive", "--set", "gap=3"}), HasSubstr("--set: there is no parameter 'gap'"));
  EXPECT_THAT(refusal({"dive", "--set", "dvl_outage=-3"}), HasSubstr("--set dvl_outage is from 0 to 3600, not -3"));
  EXPECT_THAT(refusal({"dive", "--set", "target=yes"}), HasSubstr("--set target is 0 or 1, not 'yes'"));
  EXPECT_THAT(refusal({"docking", "--set", "gpa=3"}), HasSubstr("no parameter 'gpa'; did you mean gap?"));
  EXPECT_THAT(refusal({"docking", "--set", "gap=-3"}), HasSubstr("--set gap is from 0 to 600, not -3"));
  EXPECT_THAT(refusal({"docking", "--settings", "no_such.yaml"}), HasSubstr("no_such.yaml is missing"));
}

TEST(EstimateCommand, WithoutATargetNavigateIsNamed) {
  const ScratchFolder scratch;
  const auto dive = scratch.path() / "dive";
  ASSERT_EQ(run_tandem({"simulate", "dive", "--out", dive, "--minutes", "1"}).status, 0);
  for (const char* command : {"estimate", "compare", "models"}) {
    const Outcome run = run_tandem({command, dive});
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.errors, "tandem: " + dive.string() +
                              " has no sensor that sees a target: for its own trajectory use tandem navigate\n");
  }
}

}  // namespace
}  // namespace tandem
