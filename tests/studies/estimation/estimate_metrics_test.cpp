#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate_metrics.hpp>

namespace tandem {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

SE3 pose(double x, double y, double yaw) { return SE3(SO3::Exp({0, 0, yaw}), Vector<3>(x, y, 0)); }

/// Truth from 0 to 2 s: chaser at the origin, target 10 m ahead on the y axis, both facing y.
Scenario standing_truth() {
  Scenario scenario;
  for (const double t : {0.0, 2.0}) {
    scenario.truth_chaser.push_back({t, pose(0, 0, std::numbers::pi / 2)});
    scenario.truth_target.push_back({t, pose(0, 10, std::numbers::pi / 2)});
  }
  return scenario;
}

TEST(EstimateMetrics, ComputesErrorsRelativeToChaser) {
  // Both estimates have the same error in the world, which must not count. Relative to the chaser, the target is 4 m
  // too far ahead, 3 m to the right, and rotated by 20°. The measurement is 1 m too short and rotated by 5°.
  const SE3 off = pose(100, -50, 1.0);
  const std::vector<SE3> chaser = {off * pose(0, 0, std::numbers::pi / 2)};
  const std::vector<TargetState> target = {off * pose(3, 14, std::numbers::pi / 2 + 20 * kDegree)};
  const std::vector<Keyframe> keyframes = {
      {1.0, KeyframeType::pose, Vector<3>(9, 0, 0), SO3::Exp({0, 0, -5 * kDegree})}};
  const auto errors = keyframe_errors(standing_truth(), keyframes, chaser, target);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].t, 1.0);
  EXPECT_EQ(errors[0].type, KeyframeType::pose);
  EXPECT_NEAR(errors[0].position.value(), 5.0, 1e-12);
  EXPECT_NEAR(errors[0].orientation.value(), 20.0, 1e-12);
  EXPECT_LE((errors[0].position_vector.value() - Vector<3>(4, -3, 0)).norm(), 1e-12) << "ahead and to the right";
  EXPECT_LE((errors[0].rotation_vector.value() - Vector<3>(0, 0, 20 * kDegree)).norm(), 1e-12);
  EXPECT_NEAR(errors[0].raw_position.value(), 1.0, 1e-12);
  EXPECT_NEAR(errors[0].raw_orientation.value(), 5.0, 1e-12);
}

TEST(EstimateMetrics, ComparesDisplacementsWithoutTrueOrientation) {
  Scenario scenario = standing_truth();
  scenario.truth_orientation = false;
  for (auto& stamped : scenario.truth_chaser) stamped.value = pose(0, 0, 0);  // the orientation must not matter
  const std::vector<Keyframe> keyframes = {{1.0, KeyframeType::position, Vector<3>(9, 0, 0), {}}};
  const auto errors = keyframe_errors(scenario, keyframes, {pose(5, 0, std::numbers::pi / 2)}, {pose(5, 12, 0.3)});
  EXPECT_NEAR(errors[0].position.value(), 2.0, 1e-12);
  EXPECT_NEAR(errors[0].raw_position.value(), 1.0, 1e-12);
  EXPECT_FALSE(errors[0].orientation || errors[0].rotation_vector);
}

TEST(EstimateMetrics, GivesNoErrorsWithoutTruth) {
  const std::vector<Keyframe> keyframes = {{1.0, KeyframeType::position, Vector<3>(9, 0, 0), {}},
                                           {3.0, KeyframeType::none, {}, {}}};
  const std::vector<SE3> poses(2);
  const std::vector<TargetState> targets(poses.begin(), poses.end());
  Scenario scenario = standing_truth();
  auto errors = keyframe_errors(scenario, keyframes, poses, targets);
  EXPECT_TRUE(errors[0].position);
  EXPECT_FALSE(errors[1].position) << "3 s is after the end of the truth";
  EXPECT_EQ(summarise(errors).n, 2);
  EXPECT_EQ(summarise(errors).compared, 1);

  scenario.truth_target.clear();
  errors = keyframe_errors(scenario, keyframes, poses, targets);
  EXPECT_FALSE(errors[0].position || errors[0].orientation || errors[0].raw_position || errors[0].raw_orientation);
  const ErrorSummary all = summarise(errors);
  EXPECT_EQ(all.n, 2);
  EXPECT_EQ(all.compared, 0);
  EXPECT_FALSE(all.position || all.orientation || all.raw_position);
}

TEST(EstimateMetrics, SummarisesByKeyframeType) {
  const std::vector<KeyframeError> errors = {{0, KeyframeType::position, 1.0, 10.0, 2.0, {}},
                                             {1, KeyframeType::position, 3.0, 30.0, 4.0, {}},
                                             {2, KeyframeType::none, 8.0, 50.0, {}, {}}};
  const ErrorSummary at_positions = summarise(errors, KeyframeType::position);
  EXPECT_EQ(at_positions.n, 2);
  EXPECT_DOUBLE_EQ(at_positions.position->mean, 2.0);
  EXPECT_DOUBLE_EQ(at_positions.position->std, 1.0) << "population standard deviation";
  EXPECT_DOUBLE_EQ(at_positions.orientation->mean, 20.0);
  EXPECT_DOUBLE_EQ(at_positions.raw_position->mean, 3.0);
  const ErrorSummary without = summarise(errors, KeyframeType::none);
  EXPECT_DOUBLE_EQ(without.position->std, 0.0);
  EXPECT_FALSE(without.raw_position);
  const ErrorSummary all = summarise(errors);
  EXPECT_EQ(all.n, 3);
  EXPECT_DOUBLE_EQ(all.position->mean, 4.0);
  EXPECT_DOUBLE_EQ(all.position->std, std::sqrt(26.0 / 3.0));
  EXPECT_EQ(summarise(errors, KeyframeType::pose).n, 0);
}

}  // namespace
}  // namespace tandem
