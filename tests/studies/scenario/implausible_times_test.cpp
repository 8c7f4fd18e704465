#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/implausible_times.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// Returns odometry that starts at 0 s, and a sensor that measures the target at every tenth pose.
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

TEST(ImplausibleTimes, AcceptsPlausibleRecordings) {
  EXPECT_EQ(implausible_times(Scenario()), "");
  EXPECT_EQ(implausible_times(recording(100, 0.1)), "");
  EXPECT_EQ(implausible_times(recording(40, 900.0)), "") << "ten hours with four poses per hour";
}

TEST(ImplausibleTimes, DetectsMicroAndNanoseconds) {
  for (const double unit : {1e6, 1e9})
    EXPECT_THAT(implausible_times(recording(100, 0.1 * unit)), HasSubstr("seem to be in micro- or nanoseconds"))
        << unit;
}

TEST(ImplausibleTimes, NamesStreamsOnBothSidesOfGap) {
  Scenario scenario = recording(100, 0.1);
  scenario.data.sensors[0].measurements.back().t += 86400;
  EXPECT_THAT(implausible_times(scenario),
              StartsWith("no data for 86399 s, between 9.900 s (the odometry) and 86409.000 s (usbl)"));
  scenario.data.sensors[0].measurements.back().t -= 86400 - 3000;
  EXPECT_EQ(implausible_times(scenario), "") << "less than an hour";
}

TEST(ImplausibleTimes, ConsidersDelays) {
  Scenario scenario = recording(100, 0.1);
  scenario.data.sensors[0].delay = 1e9;
  EXPECT_THAT(implausible_times(scenario), HasSubstr("(usbl) and 0.000 s (the odometry)"));
}

TEST(ImplausibleTimes, ChecksOwnSensorsWithoutOdometry) {
  Scenario scenario;
  NavigationData& own = scenario.navigation.emplace();
  EgoSensor& gps = own.sensors.emplace_back();
  gps.name = "gps";
  for (const double t : {0.0, 1.0, 2.0, 86402.0, 86403.0}) gps.measurements.emplace_back().t = t;
  EXPECT_THAT(implausible_times(scenario), HasSubstr("(gps) and 86402.000 s (gps)"));
}

/// A sensor at 5 Hz in milliseconds, with an IMU in seconds. There is no gap of an hour and no long step.
TEST(ImplausibleTimes, DetectsSensorInMilliseconds) {
  Scenario scenario;
  NavigationData& own = scenario.navigation.emplace();
  own.imu.emplace();
  for (int i = 0; i < 6000; ++i) own.imu->samples.emplace_back().t = 0.01 * i;
  EgoSensor& dvl = own.sensors.emplace_back();
  dvl.name = "dvl";
  for (int i = 0; i < 300; ++i) dvl.measurements.emplace_back().t = 0.2 * i;
  EXPECT_EQ(implausible_times(scenario), "");
  dvl.measurements.back().t = 1000;
  EXPECT_EQ(implausible_times(scenario), "") << "a single wrong time costs little";
  for (int i = 0; i < 300; ++i) dvl.measurements[std::size_t(i)].t = 200.0 * i;
  EXPECT_THAT(implausible_times(scenario), StartsWith("300 rows of dvl are 200 s apart, but the imu covers only 60 s"));
}

TEST(ImplausibleTimes, MessageIsShortForHugeTimes) {
  Scenario scenario = recording(100, 0.1);
  scenario.data.odometry.back().t = 1e300;
  EXPECT_LE(implausible_times(scenario).size(), 200u);
}

TEST(ImplausibleTimes, DetectsTooManyKeyframes) {
  Scenario scenario = recording(1000, 0.1);
  scenario.data.keyframe_interval = 1e-4;
  EXPECT_THAT(implausible_times(scenario), HasSubstr("100 measurements of the target need 999100 keyframes"));
}

}  // namespace
}  // namespace tandem
