#include <chrono>
#include <csignal>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "run_tandem.hpp"

/// Time limits and interrupts end every command with its results so far, and a message.
namespace tandem {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

TEST(CutShort, TimeLimitIncludesCovariances) {
  const Outcome none = run_tandem({"estimate", "docking_a", "--no-covariance", "--json"});
  EXPECT_EQ(none.status, 0) << none.errors;
  EXPECT_EQ(Json::parse(none.output)["no_covariance"], "not requested");
  const ScratchFolder scratch;
  const auto start = Clock::now();
  const Outcome cut =
      run_tandem({"estimate", "docking_a", "--time-limit", "1e-3", "--out", (scratch.path() / "out").string()});
  EXPECT_EQ(cut.status, 2);
  EXPECT_THAT(cut.errors, HasSubstr("did not converge (time-limit)"));
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "out" / "target.tum")) << "the results so far";
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(10));
  EXPECT_THAT(rejection({"estimate", "docking_a", "--hold-out", "5", "--no-covariance"}), HasSubstr("--no-covariance"));
}

TEST(CutShort, NamesModelsThatExceedTimeLimit) {
  const Outcome run = run_tandem({"models", "docking_a", "--models", "constant-twist", "--time-limit", "1e-3"});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.errors, HasSubstr("1 of 1 models did not converge: constant-twist"));
}

TEST(CutShort, IncompleteNavigationEndsComparisons) {
  const ScratchFolder scratch;
  const std::string run = (scratch.path() / "run").string();
  ASSERT_EQ(run_tandem({"simulate", "dive", "--minutes", "1", "--out", run}).status, 0);
  std::string yaml = read_file(scratch.path() / "run/scenario.yaml");
  yaml.replace(yaml.find("sensors:"), 8,
               "noise:\n  constant_twist: [1, 1, 1, 1, 1, 1]\nsensors:\n  usbl: {type: position, file: usbl.csv, "
               "sigma: [1, 1, 1]}");
  scratch.write("run/scenario.yaml", yaml);
  scratch.write("run/usbl.csv", "t,x,y,z\n10,5,0,0\n20,5,0,0\n30,5,0,0\n");
  for (const char* command : {"models", "compare"}) {
    const Outcome cut = run_tandem({command, run, "--time-limit", "1e-3"});
    EXPECT_EQ(cut.status, 2) << command << cut.output;
    EXPECT_THAT(cut.errors, HasSubstr("the time limit was reached")) << command;
  }
}

TEST(CutShort, CalibrationWritesOnlyValidatedNoise) {
  const ScratchFolder scratch;
  const auto noise = scratch.path() / "noise.yaml";
  const Outcome run = run_tandem({"calibrate", "docking_a", "--time-limit", "1e-3", "--write-noise", noise.string()});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.errors,
              HasSubstr("the time limit was reached; the noise is not validated, so the given one is kept"));
  EXPECT_THAT(read_file(noise), HasSubstr("These are the given standard deviations."));
}

/// The folder takes long to read, so that SIGTERM arrives during reading.
TEST(CutShort, InterruptEndsReading) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  std::string odometry;
  for (int i = 0; i < 400'000; ++i) odometry += fmt::format("{} {} 0 0 0 0 0 1\n", 0.01 * i, 0.01 * i);
  scratch.write("chaser_odometry.tum", odometry);
  for (const char* command : {"estimate", "models", "compare", "calibrate"}) {
    const int error_fd = open((scratch.path() / "errors").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const pid_t child = start_tandem({command, scratch.path().string()}, scratch.path() / "output", error_fd);
    close(error_fd);
    // Waits until the process catches SIGTERM; before that, the signal would end it.
    const auto catches_sigterm = [status = fmt::format("/proc/{}/status", child)] {
      const std::string text = read_file(status), caught = "SigCgt:\t";
      return (std::stoull(text.substr(text.find(caught) + caught.size(), 16), nullptr, 16) >> (SIGTERM - 1) & 1) != 0;
    };
    while (!catches_sigterm()) usleep(1000);
    kill(child, SIGTERM);
    EXPECT_EQ(exit_status(child), 2) << command;
    EXPECT_THAT(read_file(scratch.path() / "errors"), HasSubstr("interrupted")) << command;
  }
}

}  // namespace
}  // namespace tandem
