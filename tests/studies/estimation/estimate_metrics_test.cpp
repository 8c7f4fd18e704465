#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate_metrics.hpp>

namespace tandem {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

SE3 pose(double x, double y, double yaw) { return SE3(SO3::Exp({0, 0, yaw}), Vector<3>(x, y, 0)); }

/// Truth over 0 … 2 s: the chaser at the origin facing y, the target on the y axis, 10 m ahead, facing y as
/// well.
Scenario standing_truth() {
  Scenario scenario;
  for (const double t : {0.0, 2.0}) {
    scenario.truth_chaser.push_back({t, pose(0, 0, std::numbers::pi / 2)});
    scenario.truth_target.push_back({t, pose(0, 10, std::numbers::pi / 2)});
  }
  return scenario;
}

TEST(Metrics, ErrorsAreRelative) {
  // Both estimates are off in the world by the same motion, which does not count; the target is 3 m aside and
  // 4 m ahead of where it is, seen from the chaser, and turned by 20°. The measurement is 1 m short and
  // turned by 5°.
  const SE3 off = pose(100, -50, 1.0);
  const std::vector<SE3> chaser = {off * pose(0, 0, std::numbers::pi / 2)};
  const std::vector<TargetState> target = {off * pose(3, 14, std::numbers::pi / 2 + 20 * kDegree)};
  const std::vector<Keyframe> keyframes = {
      {1.0, KeyframeType::optical, Vector<3>(9, 0, 0), SO3::Exp({0, 0, -5 * kDegree})}};
  const auto errors = keyframe_errors(standing_truth(), keyframes, chaser, target);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].t, 1.0);
  EXPECT_EQ(errors[0].type, KeyframeType::optical);
  EXPECT_NEAR(errors[0].position.value(), 5.0, 1e-12);
  EXPECT_NEAR(errors[0].orientation.value(), 20.0, 1e-12);
  EXPECT_LE((errors[0].position_vector.value() - Vector<3>(4, -3, 0)).norm(), 1e-12) << "ahead, and to the right";
  EXPECT_LE((errors[0].rotation_vector.value() - Vector<3>(0, 0, 20 * kDegree)).norm(), 1e-12);
  EXPECT_NEAR(errors[0].raw_position.value(), 1.0, 1e-12);
  EXPECT_NEAR(errors[0].raw_orientation.value(), 5.0, 1e-12);
}

TEST(Metrics, TruthWithoutOrientationComparesDisplacements) {
  Scenario scenario = standing_truth();
  scenario.truth_orientation = false;
  for (auto& stamped : scenario.truth_chaser) stamped.value = pose(0, 0, 0);  // its orientation says nothing
  const std::vector<Keyframe> keyframes = {{1.0, KeyframeType::usbl, Vector<3>(9, 0, 0), {}}};
  const auto errors = keyframe_errors(scenario, keyframes, {pose(5, 0, std::numbers::pi / 2)}, {pose(5, 12, 0.3)});
  EXPECT_NEAR(errors[0].position.value(), 2.0, 1e-12);
  EXPECT_NEAR(errors[0].raw_position.value(), 1.0, 1e-12);
  EXPECT_FALSE(errors[0].orientation || errors[0].rotation_vector);
}

TEST(Metrics, AbsentTruthGivesNoErrors) {
  const std::vector<Keyframe> keyframes = {{1.0, KeyframeType::usbl, Vector<3>(9, 0, 0), {}},
                                           {3.0, KeyframeType::gated, {}, {}}};
  const std::vector<SE3> poses(2);
  const std::vector<TargetState> targets(poses.begin(), poses.end());
  Scenario scenario = standing_truth();
  auto errors = keyframe_errors(scenario, keyframes, poses, targets);
  EXPECT_TRUE(errors[0].position);
  EXPECT_FALSE(errors[1].position) << "3 s is beyond the truth";
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

TEST(Metrics, SummariesAreByType) {
  const std::vector<KeyframeError> errors = {{0, KeyframeType::usbl, 1.0, 10.0, 2.0, {}},
                                             {1, KeyframeType::usbl, 3.0, 30.0, 4.0, {}},
                                             {2, KeyframeType::gated, 8.0, 50.0, {}, {}}};
  const ErrorSummary usbl = summarise(errors, KeyframeType::usbl);
  EXPECT_EQ(usbl.n, 2);
  EXPECT_DOUBLE_EQ(usbl.position->mean, 2.0);
  EXPECT_DOUBLE_EQ(usbl.position->std, 1.0) << "of the population";
  EXPECT_DOUBLE_EQ(usbl.orientation->mean, 20.0);
  EXPECT_DOUBLE_EQ(usbl.raw_position->mean, 3.0);
  const ErrorSummary gated = summarise(errors, KeyframeType::gated);
  EXPECT_DOUBLE_EQ(gated.position->std, 0.0);
  EXPECT_FALSE(gated.raw_position);
  const ErrorSummary all = summarise(errors);
  EXPECT_EQ(all.n, 3);
  EXPECT_DOUBLE_EQ(all.position->mean, 4.0);
  EXPECT_DOUBLE_EQ(all.position->std, std::sqrt(26.0 / 3.0));
  EXPECT_EQ(summarise(errors, KeyframeType::optical).n, 0);
}

}  // namespace
}  // namespace tandem
