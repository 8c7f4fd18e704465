#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/implausible_times.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// Odometry from 0 s on, and a sensor that sees the target every ten of its poses.
Scenario recording(int poses, double step) {
  Scenario scenario;
  scenario.data.keyframe_interval = 1.0;
  TargetSensor& sensor = scenario.data.sensors.emplace_back();
  sensor.name = "usbl";
  for (int k = 0; k < poses; ++k) {
    scenario.data.odometry.push_back({step * k, SE3()});
    if (k % 10 == 0) sensor.measurements.emplace_back().t = step * k;
  }
  return scenario;
}

TEST(ImplausibleTimes, NothingOfGoodRecordings) {
  EXPECT_EQ(implausible_times(Scenario()), "");
  EXPECT_EQ(implausible_times(recording(100, 0.1)), "");
  EXPECT_EQ(implausible_times(recording(40, 900.0)), "") << "ten hours, a pose each quarter of one";
}

TEST(ImplausibleTimes, StampsThatAreNotInSeconds) {
  for (const double unit : {1e6, 1e9})
    EXPECT_THAT(implausible_times(recording(100, 0.1 * unit)), HasSubstr("in nano- or microseconds?")) << unit;
}

TEST(ImplausibleTimes, GapsNameWhatIsOnEitherSide) {
  Scenario scenario = recording(100, 0.1);
  scenario.data.sensors[0].measurements.back().t += 86400;
  EXPECT_THAT(implausible_times(scenario),
              StartsWith("nothing was recorded between 9.900 s (the odometry) and 86409.000 s (usbl), for 86399 s"));
  scenario.data.sensors[0].measurements.back().t -= 86400 - 3000;
  EXPECT_EQ(implausible_times(scenario), "") << "less than an hour";
}

TEST(ImplausibleTimes, ADelayMovesASensorsTimes) {
  Scenario scenario = recording(100, 0.1);
  scenario.data.sensors[0].delay = 1e9;
  EXPECT_THAT(implausible_times(scenario), HasSubstr("(usbl) and 0.000 s (the odometry)"));
}

TEST(ImplausibleTimes, OwnSensorsCountWhereTheyMoveTheChaser) {
  Scenario scenario;
  NavigationData& own = scenario.navigation.emplace();
  EgoSensor& gps = own.sensors.emplace_back();
  gps.name = "gps";
  for (const double t : {0.0, 1.0, 2.0, 86402.0, 86403.0}) gps.measurements.emplace_back().t = t;
  EXPECT_THAT(implausible_times(scenario), HasSubstr("(gps) and 86402.000 s (gps)"));
}

TEST(ImplausibleTimes, MoreKeyframesThanAreMeant) {
  Scenario scenario = recording(1000, 0.1);
  scenario.data.keyframe_interval = 1e-4;
  EXPECT_THAT(implausible_times(scenario), HasSubstr("100 measurements of the target would take 999100 keyframes"));
}

}  // namespace
}  // namespace tandem
