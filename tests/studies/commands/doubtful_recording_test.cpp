#include <map>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/scenario/table.hpp>

#include "run_tandem.hpp"

/// Messages about wrong recordings: outliers, implausible times, and limits that contradict the data.
namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using Json = nlohmann::json;

/// docking_a with one additional USBL fix whose x coordinate is the parameter [m]. It is at an existing keyframe, so
/// that the keyframes do not change.
class OneOutlier : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const auto from = std::filesystem::path(paths::source) / "share/scenarios/docking_a";
    std::filesystem::copy(from, scratch_.path() / "run");
    std::istringstream in(read_file(from / "usbl.csv"));
    std::string text, line;
    for (int i = 0; std::getline(in, line); ++i) {
      text += line + "\n";
      if (i != 40) continue;
      const std::size_t t = line.find(','), x = line.find(',', t + 1);
      stamp_ = fmt::format("{:.4f}", std::stod(line.substr(0, t)) + 4e-4);
      text += stamp_ + "," + GetParam() + line.substr(x) + "\n";
    }
    scratch_.write("run/usbl.csv", text);
  }
  std::string run() const { return (scratch_.path() / "run").string(); }
  /// Returns the estimated positions of the target by time.
  std::map<double, Vector<3>> target_of(const std::string& scenario, bool graduated) const {
    const auto out = scratch_.path() / "out";
    std::vector<std::string> words = {"estimate", scenario, "--robust", "--plots", "off", "--out", out.string()};
    if (graduated) words.emplace_back("--graduated");
    const Outcome outcome = run_tandem(words);
    EXPECT_EQ(outcome.status, 0) << outcome.output << outcome.errors;
    std::map<double, Vector<3>> target;
    for (const auto& [t, pose] : poses(read_tum(out / "target.tum"))) target[t] = pose.translation();
    return target;
  }

  ScratchFolder scratch_;
  std::string stamp_;
};

TEST_P(OneOutlier, IsReportedWithoutRobust) {
  const Outcome outcome = run_tandem({"estimate", run()});
  EXPECT_THAT(outcome.output, HasSubstr("usbl at " + stamp_.substr(0, stamp_.size() - 1)));
  EXPECT_THAT(outcome.output, HasSubstr(" standard deviations from where the other measurements put the target"));
  EXPECT_THAT(outcome.output, HasSubstr("--robust"));
  const Json json = Json::parse(run_tandem({"estimate", run(), "--json"}).output);
  ASSERT_EQ(json["suspects"].size(), 1u);
  EXPECT_EQ(json["suspects"][0]["sensor"], "usbl");
}

TEST_P(OneOutlier, DoesNotChangeRobustEstimate) {
  for (const bool graduated : {false, true}) {
    const auto expected = target_of("docking_a", graduated), found = target_of(run(), graduated);
    ASSERT_EQ(found.size(), expected.size());
    double moved = 0;
    for (const auto& [t, position] : expected) moved = std::max(moved, (found.at(t) - position).norm());
    EXPECT_LE(moved, 0.01) << "m" << (graduated ? ", graduated" : "");
  }
}

INSTANTIATE_TEST_SUITE_P(RecordedMetres, OneOutlier, testing::Values("1000", "1e6", "-9e6"),
                         [](const auto& info) { return "X" + std::to_string(info.index); });

/// Writes the small scenario with an additional last row of odometry at a time.
void end_odometry_at(const ScratchFolder& scratch, const std::string& t) {
  write_small_scenario(scratch);
  scratch.write("chaser_odometry.tum", read_file(scratch.path() / "chaser_odometry.tum") + t + " 6 0 0 0 0 0 1\n");
}

TEST(ImplausibleTimes, RejectsGapOfADayUnlessForced) {
  const ScratchFolder scratch;
  end_odometry_at(scratch, "86405");
  EXPECT_THAT(rejection({"estimate", scratch.path().string()}),
              HasSubstr("no data for 86400 s, between 5.000 s (the odometry) and 86405.000 s (the odometry); one of "
                        "them may be on another clock; use --force to accept the recording"));
  end_odometry_at(scratch, "3700");
  EXPECT_EQ(run_tandem({"estimate", scratch.path().string()}).status, 1);
  EXPECT_EQ(run_tandem({"estimate", scratch.path().string(), "--force", "--no-covariance"}).status, 0);
}

TEST(ImplausibleTimes, RejectsNanosecondsBeforeAllocatingMemory) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  std::string odometry;
  for (int t = 0; t <= 5; ++t) odometry += std::to_string(t) + "00000000 " + std::to_string(t) + " 0 0 0 0 0 1\n";
  scratch.write("chaser_odometry.tum", odometry);
  EXPECT_THAT(rejection({"estimate", scratch.path().string()}),
              HasSubstr("rows of the odometry are 1e+08 s apart; times must be in seconds, but these seem to be in "
                        "micro- or nanoseconds"));
}

TEST(ImplausibleTimes, RejectsTooManyKeyframes) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  std::string yaml = read_file(scratch.path() / "scenario.yaml");
  yaml.replace(yaml.find("interval: 1.0"), 13, "interval: 0.002");
  scratch.write("scenario.yaml", yaml);
  std::string odometry;
  for (int t = 0; t <= 1000; t += 10) odometry += std::to_string(t) + " " + std::to_string(t) + " 0 0 0 0 0 1\n";
  scratch.write("chaser_odometry.tum", odometry);
  for (const char* command : {"estimate", "models", "compare"}) {
    const Outcome run = run_tandem({command, scratch.path().string()});
    EXPECT_EQ(run.status, 1) << command;
    EXPECT_THAT(run.errors, ContainsRegex("need [0-9]+ keyframes")) << command;
  }
}

TEST(ImplausibleTimes, ChecksOnlyStreamsInUse) {
  const ScratchFolder scratch;
  const std::string run = (scratch.path() / "run").string();
  ASSERT_EQ(run_tandem({"simulate", "dive", "--minutes", "1", "--out", run}).status, 0);
  scratch.write("run/chaser_odometry.tum", "0 0 0 0 0 0 0 1\n86400 0 0 0 0 0 0 1\n");
  const std::string yaml = read_file(scratch.path() / "run/scenario.yaml");
  scratch.write("run/scenario.yaml", yaml + "noise: {prior: [1, 1, 1, 1, 1, 1], odometry: [1, 1, 1, 1, 1, 1]}\n");
  const Outcome navigated = run_tandem({"navigate", run, "--no-covariance"});
  EXPECT_EQ(navigated.status, 0) << navigated.errors;
}

TEST(Limits, ContradictionWithDataIsReported) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  std::string yaml = read_file(scratch.path() / "scenario.yaml");
  scratch.write("scenario.yaml", yaml + "  surge: 0.01\n");
  const Outcome slow = run_tandem({"estimate", scratch.path().string(), "--surge", "0,0.5"});
  EXPECT_THAT(slow.output,
              HasSubstr("Without its limits (surge within 0 … 0.5 m/s), the target would exceed them in 6 of 6 "
                        "intervals"))
      << slow.errors;
  const Outcome fast = run_tandem({"estimate", scratch.path().string(), "--surge", "0,1.5"});
  EXPECT_THAT(fast.output, testing::Not(HasSubstr("Without its limits"))) << fast.errors;
}

TEST(HardConstraints, SelectSolverThatSupportsThem) {
  const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "40", "--roll-pitch", "hard", "--json"});
  EXPECT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(Json::parse(run.output)["solver"], "augmented-lagrangian");
}

}  // namespace
}  // namespace tandem
