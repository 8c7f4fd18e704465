#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "needs_program.hpp"
#include "run_tandem.hpp"
#include "shared_data.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

class CalibrateCommand : public testing::Test {
 protected:
  void SetUp() override {
    run_ = scratch_.path() / "run";
    ASSERT_EQ(run_tandem({"simulate", "docking", "--seed", "3", "--minutes", "1", "--out", run_.string()}).status, 0);
    noise_ = (scratch_.path() / "noise.yaml").string();
  }
  std::string run() const { return run_.string(); }

  ScratchFolder scratch_;
  std::filesystem::path run_;
  std::string noise_;
};

TEST_F(CalibrateCommand, EstimatesConstantSystematicErrors) {
  const Outcome outcome = run_tandem({"calibrate", run(), "--free", "usbl.scale,usbl.delay", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_TRUE(json["parameters"].empty());
  ASSERT_EQ(json["systematic_errors"].size(), 2u);
  EXPECT_EQ(json["systematic_errors"]["usbl.scale"]["scenario"], "docking_3")
      << "the name of the scenario, not the folder";
  for (const auto& found : json["systematic_errors"]) {  // the simulation has none
    EXPECT_LT(std::abs(found["value"].get<double>()), 4 * found["sigma"].get<double>()) << found;
    EXPECT_LE(found["held_out"]["gain"], found["held_out"]["gain_error"]) << "they do not improve predictions";
  }
  const Outcome table = run_tandem({"calibrate", run(), "--free", "usbl.scale"});
  EXPECT_THAT(table.output, HasSubstr("systematic error"));
  EXPECT_THAT(run_tandem({"calibrate", run(), "--free", "usbl.scale", "--write-noise", noise_}).errors,
              HasSubstr("--write-noise writes calibrated noise, but --free names none"));
  EXPECT_THAT(run_tandem({"calibrate", run(), "--free", "usb.scale"}).errors,
              HasSubstr("--free: unknown sensor 'usb'"));
  const Outcome estimate = run_tandem({"estimate", run(), "--error", "usbl.scale=0.05", "--json"});
  EXPECT_TRUE(nlohmann::json::parse(estimate.output)["systematic_errors"].contains("usbl.scale")) << estimate.errors;
}

/// Every command reports a constant bias like the other constants, in space and in the plane.
TEST_F(CalibrateCommand, ReportsConstantBiases) {
  const auto errors = [](const std::vector<std::string>& words) {
    const Outcome outcome = run_tandem(words);
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    return nlohmann::json::parse(outcome.output)["systematic_errors"];
  };
  const auto reported = errors({"estimate", run(), "--error", "usbl=3,3,3", "--json"});
  ASSERT_EQ(reported.size(), 3u) << reported;
  EXPECT_LT(reported["usbl.bias.3"]["sigma"], 3.0);
  EXPECT_GT(reported["usbl.bias.3"]["sigma"], 0.0);
  EXPECT_EQ(errors({"estimate", run(), "--error", "usbl=3,3,3:60", "--json"}).size(), 0u)
      << "a bias that varies is not a constant";
  EXPECT_THAT(run_tandem({"estimate", run(), "--error", "usbl=3,3,3"}).output,
              ContainsRegex("Systematic errors .*\n  usbl.bias.1 -?[0-9.]+ ± [0-9.]+: "));
  EXPECT_THAT(run_tandem({"calibrate", run(), "--free", "usbl.scale", "--error", "usbl=3,3,3", "--folds", "0"}).output,
              ContainsRegex("usbl.bias.1 +3 "));
  const std::string plane = (scratch_.path() / "plane").string(), dive = (scratch_.path() / "dive").string();
  ASSERT_EQ(run_tandem({"simulate", "docking", "--minutes", "3", "--set", "planar=1", "--out", plane}).status, 0);
  EXPECT_EQ(errors({"estimate", plane, "--error", "usbl=3,3", "--json"}).size(), 2u);
  ASSERT_EQ(run_tandem({"simulate", "dive", "--minutes", "1", "--out", dive}).status, 0);
  EXPECT_TRUE(errors({"navigate", dive, "--error", "depth=1", "--json"}).contains("depth.bias.1"));
}

TEST_F(CalibrateCommand, WritesNoiseForOtherCommands) {
  const Outcome outcome =
      run_tandem({"calibrate", run(), "--free", "usbl.x,constant_twist.x", "--folds", "2", "--write-noise", noise_});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  for (const char* text : {"parameter", "usbl.x", "constant_twist.x", "held out in 2 folds", "Noise written to"})
    EXPECT_THAT(outcome.output, HasSubstr(text));
  EXPECT_THAT(outcome.output,
              ContainsRegex("\n  docking_3: log-likelihood per measurement -?[0-9.]+ with the given noise, -?[0-9.]+"));
  EXPECT_THAT(read_file(noise_), ContainsRegex("noise:\n  usbl: \\[.*\\]\n  constant_twist: \\[.*\\]\n$"));
  for (const char* command : {"estimate", "track", "models", "compare"}) {
    std::vector<std::string> words = {command, run(), "--noise-from", noise_, "--json"};
    if (command == std::string("models")) words.insert(words.end(), {"--models", "constant-twist"});
    if (command == std::string("compare"))
      words.insert(words.end(), {"--constraints", "off", "--solvers", "gauss-newton"});
    EXPECT_EQ(run_tandem(words).status, 0) << command << run_tandem(words).errors;
  }
}

TEST_F(CalibrateCommand, WritesPlanarNoiseForOtherCommands) {
  const std::string plane = (scratch_.path() / "plane").string();
  ASSERT_EQ(run_tandem({"simulate", "docking", "--minutes", "3", "--set", "planar=1", "--out", plane}).status, 0);
  const Outcome outcome = run_tandem({"calibrate", plane, "--non-holonomic", "soft", "--free", "usbl,non_holonomic",
                                      "--folds", "0", "--write-noise", noise_});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(read_file(noise_), ContainsRegex("non_holonomic: \\[[^,]*\\]"));
  for (const char* command : {"estimate", "track"}) {
    const Outcome taken = run_tandem({command, plane, "--non-holonomic", "soft", "--noise-from", noise_, "--json"});
    EXPECT_EQ(taken.status, 0) << taken.errors;
  }
}

TEST_F(CalibrateCommand, NoiseFileChangesOnlyItsEntries) {
  const auto cost = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"estimate", run(), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return nlohmann::json::parse(run_tandem(words).output)["cost"].get<double>();
  };
  const auto file = scratch_.write("usbl.yaml", "noise:\n  usbl: [9, 9, 9]\n").string();
  EXPECT_NE(cost({"--noise-from", file}), cost({}));
  EXPECT_EQ(cost({"--noise-from", file}), cost({"--noise", "usbl=9,9,9"}));
  EXPECT_EQ(cost({"--noise", "usbl=2,2,2", "--noise-from", file}), cost({"--noise", "usbl=2,2,2"}))
      << "--noise overrides --noise-from in any order";
}

TEST_F(CalibrateCommand, WritesCorrelationTimesForOtherCommands) {
  const std::vector<std::string> error = {"--error", "usbl=1,1,1:10"};
  std::vector<std::string> words = {"calibrate", run(), "--free", "usbl.time", "--folds", "2", "--write-noise", noise_};
  words.insert(words.end(), error.begin(), error.end());
  const Outcome outcome = run_tandem(words);
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output, HasSubstr("usbl.time"));
  EXPECT_THAT(read_file(noise_), ContainsRegex("noise:\n  usbl.time: \\[.*\\]\n$"));
  const auto file = scratch_.write("time.yaml", "noise:\n  usbl.time: [1]\n").string();
  for (const char* command : {"estimate", "track", "models", "compare"}) {
    words = {command, run(), "--noise-from", file, "--json"};
    words.insert(words.end(), error.begin(), error.end());
    if (command == std::string("models")) words.insert(words.end(), {"--models", "constant-twist"});
    if (command == std::string("compare"))
      words.insert(words.end(), {"--constraints", "off", "--solvers", "gauss-newton"});
    EXPECT_EQ(run_tandem(words).status, 0) << command << run_tandem(words).errors;
  }
  const auto cost = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {"estimate", run(), "--json"};
    all.insert(all.end(), more.begin(), more.end());
    return nlohmann::json::parse(run_tandem(all).output)["cost"].get<double>();
  };
  EXPECT_EQ(cost({"--error", "usbl=1,1,1:10", "--noise-from", file}), cost({"--error", "usbl=1,1,1:1"}));
  EXPECT_NE(cost({"--error", "usbl=1,1,1:10"}), cost({"--error", "usbl=1,1,1:1"}));
  const auto tails = scratch_.write("dof.yaml", "noise:\n  usbl.dof: [6]\n").string();
  EXPECT_EQ(cost({"--noise-from", tails}), cost({"--loss", "usbl=student-t:3"}));
}

TEST_F(CalibrateCommand, RejectsMissingTimeConstantsAndDegreesOfFreedom) {
  EXPECT_THAT(rejection({"calibrate", run(), "--free", "twist_time"}), HasSubstr("--model damped-twist"));
  EXPECT_THAT(rejection({"calibrate", run(), "--free", "usbl.time"}), HasSubstr("--error usbl="));
  EXPECT_THAT(rejection({"calibrate", run(), "--free", "usbl.dof"}), HasSubstr("--loss usbl=student-t:3"));
  const auto file = scratch_.write("time.yaml", "noise:\n  usbl.time: [1]\n").string();
  EXPECT_THAT(rejection({"estimate", run(), "--noise-from", file}), HasSubstr("has no bias with a correlation time"));
  const auto two = scratch_.write("two.yaml", "noise:\n  usbl.dof: [1, 2]\n").string();
  EXPECT_THAT(rejection({"estimate", run(), "--noise-from", two}), HasSubstr("takes one positive number"));
}

TEST_F(CalibrateCommand, WritesPlots) {
  TANDEM_NEEDS_GNUPLOT("plots of calibrate");
  const auto out = scratch_.path() / "out";
  const Outcome outcome = run_tandem(
      {"calibrate", run(), "--free", "usbl.x,usbl.delay", "--folds", "0", "--profiles", "--out", out.string(), "-q"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(outcome.errors, "");
  for (const char* file : {"summary.json", "noise.yaml", "run.yaml", "parameters.csv", "evidence.csv", "residuals.csv",
                           "autocorrelation.csv", "evidence.svg", "constants_evidence.svg", "residual_noise.svg"})
    EXPECT_TRUE(std::filesystem::exists(out / file)) << file;
}

TEST_F(CalibrateCommand, WritesEvidenceAlongConstants) {
  const auto out = scratch_.path() / "out";
  const Outcome outcome = run_tandem({"calibrate", run(), "--free", "usbl.delay,usbl.scale,usbl.misalignment",
                                      "--folds", "0", "--profiles", "--out", out.string(), "--plots", "off", "-q"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const std::string constants = read_file(out / "constants.csv"), along = read_file(out / "constants_evidence.csv");
  EXPECT_THAT(constants, HasSubstr("docking_3,usbl.misalignment.rz,0.1,"));
  EXPECT_EQ(std::count(along.begin(), along.end(), '\n'), 1 + 2 * 7) << along;
  EXPECT_THAT(along, ContainsRegex("docking_3,usbl.scale,[^,]*,0\n")) << "zero at the estimate";
  EXPECT_THAT(along, HasSubstr("docking_3,usbl.delay,"));
}

TEST_F(CalibrateCommand, RejectsScenarioGivenTwice) {
  EXPECT_THAT(rejection({"calibrate", run(), run()}), HasSubstr(run() + " is given twice; remove one"));
  const std::string other = run() + "/../run/";
  EXPECT_THAT(rejection({"calibrate", run(), other}), HasSubstr(other + " is given twice, also as " + run()));
  const auto link = scratch_.path() / "link";
  std::filesystem::create_directory_symlink(run_, link);
  EXPECT_THAT(rejection({"calibrate", link.string(), run()}), HasSubstr("also as " + link.string()));
}

TEST_F(CalibrateCommand, RejectsDegreesOfFreedomWithOtherLoss) {
  const auto tails = scratch_.write("dof.yaml", "noise:\n  usbl.dof: [6]\n").string();
  for (const char* loss : {"usbl=cauchy", "usbl=off"})
    EXPECT_THAT(
        rejection({"estimate", run(), "--noise-from", tails, "--loss", loss}),
        testing::AllOf(HasSubstr("--noise-from " + tails + " usbl.dof: degrees of freedom need a student-t loss"),
                       HasSubstr(std::string("--loss ") + loss)));
  for (const char* loss : {"usbl=student-t:3", "cauchy:2", "optical=cauchy:2"})
    EXPECT_EQ(run_tandem({"estimate", run(), "--noise-from", tails, "--loss", loss, "--quiet"}).status, 0) << loss;
}

/// A short recording determines few parameters. The others, with less than one effective row, keep the given values.
TEST(RecordedCalibration, ShortRecordingDeterminesFewParameters) {
  TANDEM_NEEDS_SHARED(1);
  const Outcome outcome = run_tandem(
      {"calibrate", shared_path("data/ferry_22_1").string(), "--max-keyframes", "60", "--folds", "0", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  int found = 0;
  const auto json = nlohmann::json::parse(outcome.output);
  for (const auto& p : json["parameters"]) {
    if (!p["identifiable"].get<bool>()) continue;
    ++found;
    EXPECT_LT(p["standard_error"].get<double>(), 0.55 * p["found"].get<double>()) << p;
    EXPECT_GT(p["effective_rows"], 1) << p;
  }
  EXPECT_GE(found, 1) << "the noise of the camera bearings";
}

/// Without a motion model, nothing determines the target where it is not measured.
TEST_F(CalibrateCommand, NamesUnobservableStates) {
  EXPECT_THAT(rejection({"calibrate", "docking_a", "--max-keyframes", "100", "--model", "no-motion", "--folds", "0"}),
              testing::AllOf(HasSubstr("docking_a: the measurements do not determine target "), HasSubstr("--robust"),
                             testing::Not(HasSubstr("Hessian")), testing::Not(HasSubstr("add a residual"))));
}

/// Motion noise stays as given while the residuals of a boat's sensors correlate.
TEST(RecordedCalibration, KeepsMotionNoiseWhileResidualsCorrelate) {
  TANDEM_NEEDS_SHARED(1);
  const Outcome run = run_tandem({"calibrate", shared_path("data/ferry_16_1").string(), "--robust", "--folds", "0",
                                  "--free", "constant_twist,lidar", "--max-keyframes", "200"});
  EXPECT_THAT(run.output, HasSubstr("not explained by white noise"));
}

TEST_F(CalibrateCommand, RejectsInvalidUsage) {
  EXPECT_THAT(rejection({"calibrate", run(), "--free", "sonar"}), HasSubstr("--free: unknown name 'sonar'"));
  EXPECT_THAT(rejection({"calibrate", run(), "--free", "usbl.bias"}), HasSubstr("--error usbl=SIGMA"));
  EXPECT_THAT(rejection({"calibrate", run(), "--folds", "1"}), HasSubstr("--folds 1"));
  const std::string time = scratch_.write("time.yaml", "noise:\n  usbl.time: [5]\n").string();
  EXPECT_THAT(rejection({"estimate", run(), "--error", "usbl=1,1,1", "--noise-from", time}),
              HasSubstr("usbl has no bias with a correlation time"));
  EXPECT_THAT(rejection({"calibrate", run(), "--within", "1"}), HasSubstr("--within takes a factor above 1"));
  EXPECT_THAT(
      rejection_as_given({"calibrate", run(), "--write-noise", (scratch_.path() / "no" / "noise.yaml").string()}),
      HasSubstr("does not exist"));
  const auto other = scratch_.write("other.yaml", "noise:\n  sonar: [1]\n").string();
  EXPECT_THAT(rejection({"estimate", run(), "--noise-from", other}),
              testing::AllOf(HasSubstr("--noise-from " + other), HasSubstr("sonar")));
  const auto broken = scratch_.write("broken.yaml", "noise:\n  usbl: [1, 0, 1]\n").string();
  EXPECT_THAT(rejection({"estimate", run(), "--noise-from", broken}), HasSubstr("broken.yaml:2"));
}

}  // namespace
}  // namespace tandem
