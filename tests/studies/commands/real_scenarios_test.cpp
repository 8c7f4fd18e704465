#include <algorithm>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/solvers/ipopt.hpp>

#include "run_tandem.hpp"
#include "shared_data.hpp"

/// Real recordings through the real command line, against what they must reach.
namespace tandem {
namespace {

using Json = nlohmann::json;

/// Summary of a run that must converge.
Json estimate(const std::string& scenario, const std::vector<std::string>& options = {}) {
  std::vector<std::string> arguments{"estimate", shared_path("data/" + scenario).string(), "--json"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const Outcome run = run_tandem(arguments);
  EXPECT_EQ(run.status, 0) << scenario << ": " << run.errors;
  const Json summary = Json::parse(run.output, nullptr, false);
  EXPECT_EQ(summary.value("status", ""), "converged") << scenario;
  return summary;
}
/// Mean error over keyframes of a type, or "all".
double position(const Json& summary, const std::string& type) { return summary["errors"][type]["position_mean_m"]; }
double angle(const Json& summary, const std::string& type) { return summary["errors"][type]["orientation_mean_deg"]; }
double raw_position(const Json& summary, const std::string& type) {
  return summary["errors"][type]["raw_position_mean_m"];
}

std::vector<std::string> scenarios(const std::string& prefix) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(shared_path("data")))
    if (entry.path().filename().string().starts_with(prefix)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

TEST(RecordedScenarios, FerriesRunAsTheyStand) {
  TANDEM_NEEDS_SHARED(3);
  ASSERT_EQ(scenarios("ferry_").size(), 3u);
  for (const std::string& name : scenarios("ferry_")) {
    const Json summary = estimate(name);
    EXPECT_LT(position(summary, "usbl"), raw_position(summary, "usbl")) << name << ": where there is a fix";
  }
}

TEST(RecordedScenarios, UsblRunsInModeB) {
  TANDEM_NEEDS_SHARED(1);
  EXPECT_EQ(estimate("usbl_ugps", {"--mode", "B", "--robust"})["mode"], "B");
}

TEST(RecordedScenarios, TheRobustSettingLeavesTurnedDetectionsOut) {
  TANDEM_NEEDS_SHARED(3);
  for (const auto& [name, degrees] :
       std::map<std::string, double>{{"kitti_0018_003", 3.0}, {"kitti_0004_002", 4.0}, {"kitti_0020_012", 3.0}})
    EXPECT_LE(angle(estimate(name, {"--robust"}), "all"), degrees) << name;
}

TEST(RecordedScenarios, TheRobustSettingMakesNoPositionMuchWorse) {
  TANDEM_NEEDS_SHARED(10);
  std::vector<std::string> names = scenarios("kitti_");
  ASSERT_EQ(names.size(), 9u);
  names.push_back("docking_a");
  for (const std::string& name : names)
    EXPECT_LE(position(estimate(name, {"--robust"}), "all"), 1.1 * position(estimate(name), "all")) << name;
}

/// Cars at many times the speed that they are held below: the penalty method neither creeps nor ends elsewhere than Ipopt.
TEST(RecordedScenarios, HardLimitsThatPullFar) {
  TANDEM_NEEDS_SHARED(3);
  if (!ipopt_available()) GTEST_SKIP() << "this build has no Ipopt";
  const std::vector<std::string> none, non_holonomic{"--non-holonomic", "hard"};
  for (const auto& more : {none, non_holonomic}) {
    const auto cost = [&](const char* solver) -> double {
      std::vector<std::string> options{"--surge", "0,2.5", "--yaw-rate", "0.3", "--solver", solver};
      options.insert(options.end(), more.begin(), more.end());
      return estimate("kitti_0008_008", options)["cost"];
    };
    const double expected = cost("ipopt");
    EXPECT_NEAR(cost("augmented-lagrangian"), expected, 1e-5 * expected);
  }
}

TEST(RecordedDocking, ModesAreInTheOrderOfThePapersTable) {
  TANDEM_NEEDS_SHARED(4);
  const Json a = estimate("docking_a"), b = estimate("docking_a", {"--mode", "B"});
  EXPECT_LT(position(a, "usbl"), position(b, "usbl"));
  EXPECT_LT(position(b, "usbl"), raw_position(b, "usbl"));
  EXPECT_NEAR(position(b, "optical"), position(a, "optical"), 0.15 * position(a, "optical"));
  EXPECT_FALSE(b["errors"]["usbl"].contains("orientation_mean_deg")) << "points have no orientation";
}

TEST(RecordedDocking, TheBestConstrainedModel) {
  TANDEM_NEEDS_SHARED(4);
  const Json without = estimate("docking_a");
  const Json with =
      estimate("docking_a", {"--non-holonomic", "hard", "--surge", "0,inf", "--solver", "augmented-lagrangian"});
  EXPECT_LE(position(with, "usbl"), 1.40);
  EXPECT_LE(angle(with, "usbl"), 10.65);
  EXPECT_LE(position(with, "gated"), position(without, "gated"));
  EXPECT_LE(with["max_violation"], 1e-6);
}

}  // namespace
}  // namespace tandem
