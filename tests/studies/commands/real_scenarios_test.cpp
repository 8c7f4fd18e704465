#include <algorithm>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/solvers/ipopt.hpp>

#include "run_tandem.hpp"
#include "shared_data.hpp"

/// Accuracy on real recordings, with the real executable.
namespace tandem {
namespace {

using Json = nlohmann::json;

/// Returns the summary of a run that must converge.
Json estimate(const std::string& scenario, const std::vector<std::string>& options = {}) {
  std::vector<std::string> arguments{"estimate", shared_path("data/" + scenario).string(), "--json"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const Outcome run = run_tandem(arguments);
  EXPECT_EQ(run.status, 0) << scenario << ": " << run.errors;
  const Json summary = Json::parse(run.output, nullptr, false);
  EXPECT_EQ(summary.value("status", ""), "converged") << scenario;
  return summary;
}
/// Mean position error [m] over the keyframes of a type, or "all".
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

TEST(RecordedScenarios, FerryEstimatesImproveFixes) {
  TANDEM_NEEDS_SHARED(3);
  ASSERT_EQ(scenarios("ferry_").size(), 3u);
  for (const std::string& name : scenarios("ferry_")) {
    const Json summary = estimate(name);
    EXPECT_LT(position(summary, "position"), raw_position(summary, "position")) << name << ": at keyframes with a fix";
  }
}

TEST(RecordedScenarios, UsblConvergesInModeB) {
  TANDEM_NEEDS_SHARED(1);
  EXPECT_EQ(estimate("usbl_ugps", {"--mode", "B", "--robust"})["mode"], "B");
}

TEST(RecordedScenarios, RobustOptionRejectsTurnedDetections) {
  TANDEM_NEEDS_SHARED(3);
  for (const auto& [name, degrees] :
       std::map<std::string, double>{{"kitti_0018_003", 3.0}, {"kitti_0004_002", 4.0}, {"kitti_0020_012", 3.0}})
    EXPECT_LE(angle(estimate(name, {"--robust"}), "all"), degrees) << name;
}

TEST(RecordedScenarios, RobustOptionKeepsPositionAccuracy) {
  TANDEM_NEEDS_SHARED(10);
  std::vector<std::string> names = scenarios("kitti_");
  ASSERT_EQ(names.size(), 9u);
  names.push_back("docking_a");
  for (const std::string& name : names)
    EXPECT_LE(position(estimate(name, {"--robust"}), "all"), 1.1 * position(estimate(name), "all")) << name;
}

/// The cars drive much faster than the speed limit, so the constraints move the solution far. The augmented Lagrangian
/// must converge to the minimum of Ipopt.
TEST(RecordedScenarios, HardLimitsFarFromData) {
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

TEST(RecordedDocking, ModesRankAsInPaper) {
  TANDEM_NEEDS_SHARED(4);
  const Json a = estimate("docking_a"), b = estimate("docking_a", {"--mode", "B"});
  EXPECT_LT(position(a, "position"), position(b, "position"));
  EXPECT_LT(position(b, "position"), raw_position(b, "position"));
  EXPECT_NEAR(position(b, "pose"), position(a, "pose"), 0.15 * position(a, "pose"));
  EXPECT_FALSE(b["errors"]["position"].contains("orientation_mean_deg")) << "points have no orientation";
}

TEST(RecordedDocking, BestConstrainedModelReachesAccuracy) {
  TANDEM_NEEDS_SHARED(4);
  const Json without = estimate("docking_a");
  const Json with =
      estimate("docking_a", {"--non-holonomic", "hard", "--surge", "0,inf", "--solver", "augmented-lagrangian"});
  EXPECT_LE(position(with, "position"), 1.40);
  EXPECT_LE(angle(with, "position"), 10.65);
  EXPECT_LE(position(with, "none"), position(without, "none"));
  EXPECT_LE(with["max_violation"], 1e-6);
}

}  // namespace
}  // namespace tandem
