#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pty.h>

#include "run_tandem.hpp"
#include "sanitized.hpp"
#include "studies/simulation/target_of_dive.hpp"

/// `tandem estimate` on a folder with raw ego sensors, a target's fixes and no odometry, through the real executable.
namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using Json = nlohmann::json;

class JointCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    const DiveOptions options{.grade = Grade::tactical, .minutes = 1};
    write_dive(simulate_dive(options), options, folder_->path());
    write_target_of_dive(dive_with_target(options, 0.3), folder_->path());
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string dive() { return folder_->path().string(); }

 private:
  static inline ScratchFolder* folder_ = nullptr;
};

TEST_F(JointCommand, EstimatesChaserAndTargetTogether) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome outcome = run_tandem({"estimate", dive(), "--json", "--out", out.string(), "--plots", "off"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const Json summary = Json::parse(outcome.output);
  EXPECT_EQ(summary["status"], "converged");
  EXPECT_GT(summary["ego_sensors"]["dvl"]["used"], 290);
  EXPECT_EQ(summary["ego_sensors"]["dvl"]["left_out"], 0);
  EXPECT_LT(summary["errors"]["all"]["position_mean_m"], 0.48) << "one fix is as far off, on average";
  for (const char* file : {"chaser.tum", "target.tum", "chaser_full.csv", "summary.json"})
    EXPECT_TRUE(std::filesystem::exists(out / file)) << file;
  EXPECT_EQ(read_file(out / "summary.json"), outcome.output);
}

TEST_F(JointCommand, TheReportSaysSo) {
  const Outcome outcome = run_tandem({"estimate", dive()});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output,
              HasSubstr("The chaser by its own sensors, together with the target; measurements used: dvl "));
}

/// A noise file for the whole folder serves a command that leaves the target aside, too; one with names of another does not.
TEST_F(JointCommand, NavigateTakesANoiseFileThatKnowsTheTargetsSensorsToo) {
  const ScratchFolder scratch;
  const auto file = scratch.write("n.yaml",
                                  "noise:\n  usbl: [2, 2, 2]\n  usbl.time: [20]\n  constant_twist: [1, 1, 1, 1, 1, 1]\n"
                                  "  dvl: [0.5, 0.5, 0.5]\n");
  const auto cost = [](std::vector<std::string> words) {
    words.insert(words.begin(), {"navigate", dive(), "--no-covariance", "--json"});
    const Outcome outcome = run_tandem(words);
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    return Json::parse(outcome.output, nullptr, false)["cost"];
  };
  EXPECT_EQ(cost({"--noise-from", file.string()}), cost({"--noise", "dvl=0.5,0.5,0.5"}));
  const auto other = scratch.write("o.yaml", "noise:\n  sonar: [2, 2, 2]\n  dvl: [0.5, 0.5, 0.5]\n").string();
  EXPECT_THAT(refusal({"navigate", dive(), "--noise-from", other}), HasSubstr("o.yaml knows no 'sonar'"));
  EXPECT_THAT(refusal({"navigate", dive(), "--noise", "usbl=2,2,2"}), HasSubstr("knows no 'usbl'"))
      << "what is typed is meant";
}

TEST_F(JointCommand, ModelsAreComparedOnItToo) {
  const Outcome outcome =
      run_tandem({"models", dive(), "--models", "constant-twist,white-noise-acceleration", "--json"});
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
}

/// Options about the chaser's own sensors reach the joint problem, whichever command poses it.
TEST_F(JointCommand, OwnSensorOptionsCount) {
  const auto summary = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"estimate", dive(), "--json"});
    const Outcome outcome = run_tandem(options);
    EXPECT_EQ(outcome.status, 0) << options.back() << ": " << outcome.errors;
    return Json::parse(outcome.output, nullptr, false);
  };
  const Json plain = summary({});
  EXPECT_FALSE(plain.contains("dvl_scale"));
  EXPECT_NEAR(double(summary({"--dvl-scale"})["dvl_scale"]), 1.0, 0.05);
  const Json without = summary({"--without", "dvl"});
  EXPECT_FALSE(without["ego_sensors"].contains("dvl"));
  EXPECT_LT(without["residual_blocks"], plain["residual_blocks"]);
  for (const std::vector<std::string>& options : {std::vector<std::string>{"--noise", "dvl=0.5,0.5,0.5"},
                                                  {"--delay", "dvl=0.05"},
                                                  {"--loss", "dvl=cauchy:0.1"},
                                                  {"--noise", "imu=2e-3,1e-4,3e-4,2e-6"},
                                                  {"--no-earth-rotation"},
                                                  {"--preintegrated-dvl"}})
    EXPECT_NE(summary(options)["cost"], plain["cost"]) << options.front() << " " << options.back();
}

TEST_F(JointCommand, OwnSensorOptionsCountInComparisonsToo) {
  const auto cost = [](std::vector<std::string> arguments, const char* list) -> double {
    arguments.insert(arguments.begin() + 1, {dive(), "--json"});
    const Outcome outcome = run_tandem(arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    return Json::parse(outcome.output)[list][0]["cost"];
  };
  const Outcome estimate = run_tandem({"estimate", dive(), "--json", "--noise", "dvl=0.5,0.5,0.5"});
  const double expected = Json::parse(estimate.output)["cost"];
  EXPECT_NEAR(cost({"models", "--models", "constant-twist", "--noise", "dvl=0.5,0.5,0.5"}, "models"), expected,
              1e-6 * expected);
  EXPECT_NEAR(
      cost({"compare", "--solvers", "gauss-newton", "--constraints", "none", "--noise", "dvl=0.5,0.5,0.5"}, "solves"),
      expected, 1e-6 * expected);
}

TEST_F(JointCommand, OptionsAboutSensorsThatAreNotThereAreRefused) {
  for (const char* command : {"estimate", "models", "compare"}) {
    const auto error = [&](std::vector<std::string> options) {
      options.insert(options.begin(), {command, dive()});
      const Outcome outcome = run_tandem(options);
      EXPECT_EQ(outcome.status, 1) << outcome.output;
      return outcome.errors;
    };
    EXPECT_THAT(error({"--delay", "dlv=0.1"}), HasSubstr("did you mean dvl?"));
    EXPECT_THAT(error({"--dvl-scale", "--without", "dvl"}), HasSubstr("--dvl-scale needs a dvl"));
  }
}

/// While the chaser is navigated, too, before the first model is tried or the first solver run.
TEST_F(JointCommand, AnInterruptWhileItNavigatesIsHeeded) {
  const ScratchFolder scratch;
  const DiveOptions options{.grade = Grade::tactical, .minutes = kSanitized ? 3.0 : 10.0};  // navigating takes a while
  write_dive(simulate_dive(options), options, scratch.path());
  write_target_of_dive(dive_with_target(options, 0.3), scratch.path());
  for (const char* command : {"models", "compare"}) {
    SCOPED_TRACE(command);
    int terminal = -1, error_fd = -1;
    ASSERT_EQ(openpty(&terminal, &error_fd, nullptr, nullptr, nullptr), 0);
    const pid_t child = start_tandem({command, scratch.path().string(), "--json"}, scratch.path() / "output", error_fd);
    close(error_fd);
    std::string errors;
    char buffer[4096];
    bool told = false;
    for (ssize_t n; (n = read(terminal, buffer, sizeof buffer)) > 0;) {
      errors.append(buffer, static_cast<std::size_t>(n));
      if (!told && errors.find("navigation: iteration ") != std::string::npos) told = kill(child, SIGINT) == 0;
    }
    close(terminal);
    EXPECT_TRUE(told);
    EXPECT_EQ(exit_status(child), 2) << errors;
    // How far it has come when the signal arrives is the machine's affair.
    EXPECT_THAT(errors, ContainsRegex("interrupted after [0-9]+ of|navigation: interrupted"));
    const std::string output = read_file(scratch.path() / "output");
    EXPECT_TRUE(output.empty() || Json::accept(output)) << output;
  }
}

}  // namespace
}  // namespace tandem
