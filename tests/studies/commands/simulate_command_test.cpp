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
              ContainsRegex("simulate +Write a simulated scenario folder: dive or docking\n"));
  const Outcome help = run_tandem({"simulate", "--help-all"});
  EXPECT_EQ(help.status, 0);
  for (const char* text : {"NAME", "--out", "--grade", "--minutes", "--seed", "--latitude", "--keyframe-interval",
                           "--surfacings", "Exit status"})
    EXPECT_THAT(help.output, HasSubstr(text));
}

TEST(SimulateCommand, WritesDive) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "dive", again = scratch.path() / "again";
  const Outcome run = run_tandem({"simulate", "dive", "--out", out, "--minutes", "2", "--grade", "tactical", "--seed",
                                  "5", "--latitude", "-45", "--keyframe-interval", "0.5"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.output, "Written to " + out.string() + "\n");
  EXPECT_EQ(run.errors, "");
  EXPECT_THAT(files(out),
              UnorderedElementsAre("scenario.yaml", "imu.csv", "dvl.csv", "depth.csv", "heading.csv", "gps.csv",
                                   "truth_chaser.tum", "truth_velocity.csv", "truth_bias.csv", "run.yaml"));
  const Scenario scenario = read_scenario(out);
  EXPECT_EQ(scenario.navigation->keyframe_interval, 0.5);
  EXPECT_LT(scenario.navigation->earth.rate.z(), 0) << "southern hemisphere";
  EXPECT_EQ(scenario.navigation->imu->samples.size(), 12'001u);
  EXPECT_EQ(scenario.navigation->imu->noise.gyroscope, DiveSensors::of(Grade::tactical).imu.gyroscope);
  ASSERT_EQ(run_tandem({"simulate", "dive", "--out", again, "--minutes", "2", "--grade", "tactical", "--seed", "5",
                        "--latitude", "-45", "--keyframe-interval", "0.5"})
                .status,
            0);
  for (const std::string& file : files(out)) EXPECT_EQ(read_file(out / file), read_file(again / file)) << file;
}

TEST(SimulateCommand, WritesDocking) {
  const ScratchFolder scratch;
  const Outcome run = run_tandem({"simulate", "docking", "--out", scratch.path(), "--minutes", "3", "--seed", "2"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(files(scratch.path()),
              UnorderedElementsAre("scenario.yaml", "chaser_odometry.tum", "usbl.csv", "optical.csv",
                                   "truth_chaser.tum", "truth_target.tum", "run.yaml"));
  const Outcome estimate = run_tandem({"estimate", scratch.path()});
  EXPECT_EQ(estimate.status, 0) << estimate.errors;
}

TEST(SimulateCommand, WritesToNonEmptyFolderOnlyIfForced) {
  const ScratchFolder scratch;
  scratch.write("scenario.yaml", "name: of the user");
  const std::vector<std::string> words = {"simulate", "dive", "--out", scratch.path(), "--minutes", "1"};
  EXPECT_THAT(rejection_as_given(words), HasSubstr("the folder is not empty; use --force to write to it"));
  EXPECT_EQ(read_file(scratch.path() / "scenario.yaml"), "name: of the user");
  std::vector<std::string> forced = words;
  forced.push_back("--force");
  EXPECT_EQ(run_tandem(forced).status, 0);
}

TEST(SimulateCommand, AppliesDockingParameters) {
  const ScratchFolder scratch;
  const std::string settings = scratch.write("trial.yaml", "minutes: 2\nseed: 4\ngap: 20\nwaves: 0.1\n");
  const std::string a = scratch.path() / "a", b = scratch.path() / "b";
  ASSERT_EQ(run_tandem({"simulate", "docking", "--settings", settings, "--set", "waves=0.05", "--out", a}).status, 0);
  ASSERT_EQ(run_tandem({"simulate", "docking", "--minutes", "2", "--seed", "4", "--set", "gap=20", "--set",
                        "waves=0.05", "--out", b})
                .status,
            0);
  for (const std::string& file : files(a))
    if (file != "run.yaml") EXPECT_EQ(read_file(a + "/" + file), read_file(b + "/" + file)) << file;
  EXPECT_THAT(read_file(a + "/scenario.yaml"), HasSubstr("seed 4, minutes=2, waves=0.05, gap=20\n"));
}

TEST(SimulateCommand, AppliesDiveParameters) {
  const ScratchFolder scratch;
  ASSERT_EQ(run_tandem({"simulate", "dive", "--minutes", "2", "--set", "target=1", "--set", "grade=tactical", "--out",
                        scratch.path()})
                .status,
            0);
  EXPECT_THAT(files(scratch.path()), testing::IsSupersetOf({"usbl.csv", "truth_target.tum"}));
  const Outcome estimate = run_tandem({"estimate", scratch.path()});
  EXPECT_EQ(estimate.status, 0) << estimate.errors;
  EXPECT_THAT(estimate.output, HasSubstr("estimated jointly from the chaser's own sensors"));
}

TEST(SimulateCommand, RejectsInvalidUsage) {
  const ScratchFolder scratch;
  const auto rejection = [&](std::vector<std::string> arguments, bool with_out = true) {
    arguments.insert(arguments.begin(), "simulate");
    if (with_out) arguments.insert(arguments.end(), {"--out", (scratch.path() / "out").string()});
    const Outcome run = run_tandem(arguments);
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.output, "");
    EXPECT_THAT(run.errors, ContainsRegex("^tandem: [^\n]+\n$"));
    EXPECT_TRUE(files(scratch.path()).empty());
    return run.errors;
  };
  EXPECT_THAT(rejection({"div"}),
              HasSubstr("unknown simulation 'div'; did you mean dive? (available: dive and docking)"));
  EXPECT_THAT(rejection({}), HasSubstr("required"));
  EXPECT_THAT(rejection({"dive"}, false), HasSubstr("--out is required"));
  EXPECT_THAT(rejection({"dive", "--grade", "tactic"}), HasSubstr("--grade takes mems or tactical, not 'tactic'"));
  EXPECT_THAT(rejection({"dive", "--minutes", "long"}), HasSubstr("--minutes takes a finite number, not 'long'"));
  EXPECT_THAT(rejection({"dive", "--minutes", "nan"}), HasSubstr("--minutes takes a finite number, not 'nan'"));
  EXPECT_THAT(rejection({"dive", "--minutes", "0"}), HasSubstr("minutes must be 1 to 600 for a dive, not 0"));
  EXPECT_THAT(rejection({"dive", "--seed", "-1"}), HasSubstr("--seed"));
  EXPECT_THAT(rejection({"dive", "--latitude", "100"}), HasSubstr("latitude must be -90 to 90 degrees, not 100"));
  EXPECT_THAT(rejection({"dive", "--minute", "3"}), HasSubstr("did you mean --minutes?"));
  EXPECT_THAT(rejection({"docking", "--grade", "mems"}), HasSubstr("simulate docking does not take --grade"));
  EXPECT_THAT(rejection({"dive", "--set", "gap=3"}), HasSubstr("--set: unknown parameter 'gap'"));
  EXPECT_THAT(rejection({"dive", "--set", "dvl_outage=-3"}),
              HasSubstr("--set dvl_outage takes a number from 0 to 3600, not -3"));
  EXPECT_THAT(rejection({"dive", "--set", "target=yes"}), HasSubstr("--set target takes 0 or 1, not 'yes'"));
  EXPECT_THAT(rejection({"docking", "--set", "gpa=3"}), HasSubstr("unknown parameter 'gpa'; did you mean gap?"));
  EXPECT_THAT(rejection({"docking", "--set", "gap=-3"}), HasSubstr("--set gap takes a number from 0 to 600, not -3"));
  EXPECT_THAT(rejection({"docking", "--settings", "no_such.yaml"}), HasSubstr("no_such.yaml is missing"));
}

TEST(EstimateCommand, SuggestsNavigateWithoutTarget) {
  const ScratchFolder scratch;
  const auto dive = scratch.path() / "dive";
  ASSERT_EQ(run_tandem({"simulate", "dive", "--out", dive, "--minutes", "1"}).status, 0);
  for (const char* command : {"estimate", "compare", "models"}) {
    const Outcome run = run_tandem({command, dive});
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.errors, "tandem: " + dive.string() +
                              " has no target sensor; for the trajectory of the chaser alone, use tandem navigate\n");
  }
}

}  // namespace
}  // namespace tandem
