#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/navigation/fit_delay.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

class FitDelay : public testing::Test {
 protected:
  static NavigationData dive() { return simulate_dive({.grade = Grade::tactical, .minutes = 1}).data; }
};

using LongFitDelay = FitDelay;
TEST_F(LongFitDelay, FindsNegativeDelayOfImu) {
  NavigationData data = dive();
  for (ImuSample& sample : data.imu->samples) sample.t -= 0.03;
  NavigationData delayed = data;  // stamps are 20 ms later than the times of the samples
  delayed.imu->delay = 0.02;
  const DelayFit fit = fit_delay(data, data.imu->name), again = fit_delay(delayed, delayed.imu->name);
  EXPECT_NEAR(again.delay, fit.delay + 0.02, 1e-3);
  ASSERT_TRUE(fit.sigma);
  EXPECT_LT(*fit.sigma, 0.01);
  EXPECT_NEAR(fit.delay, -0.03, 3 * *fit.sigma + 1e-3);  // resolution of the search: 1 ms
  EXPECT_LT(fit.cost, fit.cost_before);
}

TEST_F(FitDelay, SetsDelayOfSensorAndImu) {
  NavigationData data = dive();
  const NavigationData before = data;
  set_delay(data, data.imu->name, -0.02);
  EXPECT_EQ(data.imu->samples[7].t, before.imu->samples[7].t + 0.02);
  EXPECT_EQ(data.imu->delay, -0.02);
  set_delay(data, data.imu->name, 0);
  EXPECT_NEAR(data.imu->samples[7].t, before.imu->samples[7].t, 1e-12);
  set_delay(data, data.sensors[0].name, 0.1);
  EXPECT_EQ(data.sensors[0].delay, 0.1);
  EXPECT_EQ(data.sensors[0].measurements[0].t, before.sensors[0].measurements[0].t);
}

TEST_F(FitDelay, RejectsUnknownSensor) {
  const NavigationData data = dive();
  EXPECT_THAT(error_of([&] { fit_delay(data, "dlv"); }), HasSubstr("cannot fit the delay of dlv"));
}

}  // namespace
}  // namespace tandem
