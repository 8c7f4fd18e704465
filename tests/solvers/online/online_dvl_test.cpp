#include <gtest/gtest.h>

#include "online_cases.hpp"

/// Online estimation with preintegrated DVL velocities.
namespace tandem {
namespace {

using testing::LevelTurn;

OnlineOptions preintegrating(const LevelTurn& turn, double window) {
  OnlineOptions options = testing::exactly(turn, window);
  options.ego.preintegrated_dvl = true;
  return options;
}

/// DVL with errors of about one standard deviation, and a heading sensor. Without it, only the start would determine
/// the heading, and a short window keeps that less accurately.
NavigationData data_of(const LevelTurn& turn) {
  NavigationData data = testing::noisy(turn);
  std::erase_if(data.sensors, [](const EgoSensor& s) { return s.name != "dvl" && s.name != "heading"; });
  return data;
}

TEST(OnlineDvl, PreintegratesALateVelocityAtItsTime) {
  const LevelTurn turn;
  const NavigationData data = data_of(turn);
  NavigationData all_but_one = data;
  auto& lines = all_but_one.sensors[0].measurements;
  lines[30].value += Vector<3>(0.1, 0, 0);
  NavigationData wrong = all_but_one;  // its effect is large enough to be seen
  const EgoMeasurement late = lines[30];
  lines.erase(lines.begin() + 30);
  OnlineEstimator in_time(TrackingData(), wrong, preintegrating(turn, 1e3));
  OnlineEstimator with_late(TrackingData(), all_but_one, preintegrating(turn, 1e3));
  replay(wrong, HUGE_VAL, in_time);
  replay(all_but_one, HUGE_VAL, with_late);
  const auto off = [&] { return (in_time.chaser().pose.translation() - with_late.chaser().pose.translation()).norm(); };
  const double before = off();
  EXPECT_FALSE(with_late.add_ego(0, late));
  with_late.finish();
  EXPECT_LE(off(), 0.01 * before);  // factors keep the gyroscope bias of their creation
  EXPECT_GT(before, 1e-2);
}

/// Factors near the newest keyframe are replaced while the oldest ones leave the window.
TEST(OnlineDvl, AShortWindowAgreesWithALongOne) {
  const LevelTurn turn;
  const NavigationData data = data_of(turn);
  OnlineEstimator brief(TrackingData(), data, preintegrating(turn, 3)),
      whole(TrackingData(), data, preintegrating(turn, 1e3));
  replay(data, HUGE_VAL, brief);
  replay(data, HUGE_VAL, whole);
  EXPECT_LE(brief.keyframes(), 5u);
  EXPECT_LE((brief.chaser().pose.translation() - whole.chaser().pose.translation()).norm(), 0.02);
  EXPECT_LE((brief.chaser().pose.translation() - LevelTurn::pose(20).translation()).norm(), 0.1);
}

}  // namespace
}  // namespace tandem
