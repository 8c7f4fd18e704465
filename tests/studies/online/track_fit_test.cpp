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

}  // namespace
}  // namespace tandem
