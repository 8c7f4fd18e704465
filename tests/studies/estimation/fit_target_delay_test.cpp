#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/estimation/fit_target_delay.hpp>
#include <tandem/studies/simulation/simulate_docking.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using ::testing::HasSubstr;

TEST(FitTargetDelay, FindsTheDelayOfFixes) {
  TrackingData data = simulate_docking({.minutes = 4, .seed = 3}).data;
  const double last = data.odometry.back().t;
  for (TargetSensor& sensor : data.sensors) {
    if (sensor.name != "usbl") continue;
    for (Measurement& m : sensor.measurements) m.t += 0.8;
    std::erase_if(sensor.measurements, [&](const Measurement& m) { return m.t > last; });
  }
  const DelayFit fit = fit_target_delay(data, "usbl", {}, GaussNewtonOptions{});
  ASSERT_TRUE(fit.sigma);
  EXPECT_NEAR(fit.delay, 0.8, 3 * *fit.sigma);
  EXPECT_LT(fit.cost, fit.cost_before);
}

TEST(FitTargetDelay, RejectsUnknownSensors) {
  const TrackingData data = simulate_docking({.minutes = 1}).data;
  EXPECT_THAT(error_of([&] { fit_target_delay(data, "sonar", {}, GaussNewtonOptions{}); }),
              HasSubstr("cannot fit the delay of sonar"));
}

}  // namespace
}  // namespace tandem
