#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pty.h>

#include "run_tandem.hpp"
#include "sanitized.hpp"
#include "studies/simulation/target_of_dive.hpp"

/// `tandem estimate` on a folder with own sensors and target fixes but without odometry, with the real executable.
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
  EXPECT_EQ(summary["ego_sensors"]["dvl"]["discarded"], 0);
  EXPECT_LT(summary["errors"]["all"]["position_mean_m"], 0.48) << "the mean error of a single fix";
  for (const char* file : {"chaser.tum", "target.tum", "chaser_full.csv", "summary.json"})
    EXPECT_TRUE(std::filesystem::exists(out / file)) << file;
  EXPECT_EQ(read_file(out / "summary.json"), outcome.output);
}

TEST_F(JointCommand, ReportNamesOwnSensors) {
  const Outcome outcome = run_tandem({"estimate", dive()});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output, HasSubstr("estimated jointly from the chaser's own sensors; measurements used: dvl "));
}

/// A noise file may name target sensors of the folder, which navigate does not use, but not unknown sensors.
TEST_F(JointCommand, NavigateAcceptsNoiseFileWithTargetSensors) {
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
  EXPECT_THAT(rejection({"navigate", dive(), "--noise-from", other}), HasSubstr("o.yaml: unknown noise 'sonar'"));
  EXPECT_THAT(rejection({"navigate", dive(), "--noise", "usbl=2,2,2"}), HasSubstr("--noise: unknown noise 'usbl'"))
      << "--noise must name a sensor in use";
}

TEST_F(JointCommand, ModelsCommandWorks) {
  const Outcome outcome =
      run_tandem({"models", dive(), "--models", "constant-twist,white-noise-acceleration", "--json"});
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
}

/// Options for the chaser's own sensors apply to the joint problem of every command.
TEST_F(JointCommand, AppliesOwnSensorOptions) {
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

TEST_F(JointCommand, ComparisonsApplyOwnSensorOptions) {
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
      cost({"compare", "--solvers", "gauss-newton", "--constraints", "off", "--noise", "dvl=0.5,0.5,0.5"}, "solves"),
      expected, 1e-6 * expected);
}

TEST_F(JointCommand, RejectsOptionsForMissingSensors) {
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

/// An interrupt also ends the navigation of the chaser, before the first model or solver runs.
TEST_F(JointCommand, InterruptEndsNavigation) {
  const ScratchFolder scratch;
  const DiveOptions options{.grade = Grade::tactical,
                            .minutes = kSanitized ? 3.0 : 10.0};  // long enough for an interrupt during the navigation
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
    bool signalled = false;
    for (ssize_t n; (n = read(terminal, buffer, sizeof buffer)) > 0;) {
      errors.append(buffer, static_cast<std::size_t>(n));
      if (!signalled && errors.find("navigation: iteration ") != std::string::npos)
        signalled = kill(child, SIGINT) == 0;
    }
    close(terminal);
    EXPECT_TRUE(signalled);
    EXPECT_EQ(exit_status(child), 2) << errors;
    // The state at which the signal arrives depends on the machine.
    EXPECT_THAT(errors, ContainsRegex("interrupted after [0-9]+ of|navigation: interrupted"));
    const std::string output = read_file(scratch.path() / "output");
    EXPECT_TRUE(output.empty() || Json::accept(output)) << output;
  }
}

}  // namespace
}  // namespace tandem
