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

/// A sensor at 5 Hz, in milliseconds beside an IMU in seconds: no gap of an hour, and no step as long as a recording's.
TEST(ImplausibleTimes, OneSensorInMilliseconds) {
  Scenario scenario;
  NavigationData& own = scenario.navigation.emplace();
  own.imu.emplace();
  for (int i = 0; i < 6000; ++i) own.imu->samples.emplace_back().t = 0.01 * i;
  EgoSensor& dvl = own.sensors.emplace_back();
  dvl.name = "dvl";
  for (int i = 0; i < 300; ++i) dvl.measurements.emplace_back().t = 0.2 * i;
  EXPECT_EQ(implausible_times(scenario), "");
  dvl.measurements.back().t = 1000;
  EXPECT_EQ(implausible_times(scenario), "") << "one wrong stamp, which costs itself";
  for (int i = 0; i < 300; ++i) dvl.measurements[std::size_t(i)].t = 200.0 * i;
  EXPECT_THAT(implausible_times(scenario), StartsWith("300 lines of dvl are 200 s apart, and the imu covers 60 s"));
}

TEST(ImplausibleTimes, SayTimesOfAnySizeInAFewDigits) {
  Scenario scenario = recording(100, 0.1);
  scenario.data.odometry.back().t = 1e300;
  EXPECT_LE(implausible_times(scenario).size(), 200u);
}

TEST(ImplausibleTimes, MoreKeyframesThanAreMeant) {
  Scenario scenario = recording(1000, 0.1);
  scenario.data.keyframe_interval = 1e-4;
  EXPECT_THAT(implausible_times(scenario), HasSubstr("100 measurements of the target would take 999100 keyframes"));
}

}  // namespace
}  // namespace tandem
