#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/online/track_report.hpp>

namespace tandem {
namespace {

using ::testing::HasSubstr;

SensorHealth sensor(const std::string& name, std::size_t used, std::size_t rejected, double nis_per_row) {
  SensorHealth s;
  s.name = name;
  s.used = used;
  s.rejected = rejected;
  s.nis_rows = 3 * used;
  s.nis = nis_per_row * double(s.nis_rows);
  return s;
}

TEST(TrackFit, InnovationsOfTheStatedSizeFit) {
  const FitReport fit = track_fit({.sensors = {sensor("usbl", 100, 1, 1.1), sensor("dvl", 1000, 0, 0.9)}});
  EXPECT_TRUE(fit.consistent());
  EXPECT_THAT(fit.verdict(), HasSubstr("The data fit the model"));
}

TEST(TrackFit, LargeInnovationsAndRejectionsAreMisfitsOfTheirSensor) {
  const FitReport fit = track_fit({.sensors = {sensor("usbl", 100, 0, 9), sensor("dvl", 1000, 200, 1)}});
  EXPECT_FALSE(fit.consistent());
  EXPECT_THAT(fit.verdict(), HasSubstr("usbl: innovations are 3 times their expected standard deviation."));
  EXPECT_THAT(fit.verdict(), HasSubstr("dvl: 200 of 1200 measurements are rejected or down-weighted"));
}

TEST(TrackFit, HasTheStatisticsOfStoredInnovations) {
  detail::HealthMonitor monitor({{"usbl", 0}}, {});
  std::array<ResidualSeries, 3> stored;
  for (int i = 0; i < 400; ++i) {
    detail::NormalizedInnovation innovation{.sigmas = 1.0, .nis = 3, .rows = 3};
    innovation.standardised = Vector<3>(std::sin(0.1 * i), 0.3 + std::cos(2.0 * i), -std::sin(7.0 * i));
    if (i % 90 == 50) innovation.standardised[1] = -3 - 0.1 * i / 90;
    innovation.down_weighted = i == 230;
    for (int c = 0; c < 3 && i != 230; ++c) stored[std::size_t(c)].add(i, innovation.standardised[c]);
    monitor.used(0, i, innovation);
  }
  const FitReport report = track_fit(monitor.health(), {{"x", "y", "z"}});
  const SensorFit& fit = report.sensors.at(0);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(fit.moments[c].mean(), stored[c].mean(), 1e-12);
    EXPECT_NEAR(fit.moments[c].standard_deviation(), stored[c].standard_deviation(), 1e-12);
    EXPECT_NEAR(fit.moments[c].correlation(), stored[c].correlation(), 1e-12);
  }
  EXPECT_GT(fit.moments[0].correlation(), 0.9);
  ASSERT_EQ(fit.worst.size(), 5u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(fit.worst[i].t, 320 - 90.0 * double(i)) << "that of a down-weighted measurement, too";
    EXPECT_EQ(fit.worst[i].component, 1u);
    EXPECT_LT(fit.worst[i].residual, -3);
  }
  EXPECT_EQ(fit.components[fit.worst_component()], "y");
}

}  // namespace
}  // namespace tandem
