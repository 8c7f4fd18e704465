#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/named_noise.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;

TEST(NamedNoise, SpansReferToStandardDeviations) {
  TrackingData data;
  data.sensors.push_back({.name = "usbl", .sigma = Vector<3>::Zero()});
  for (const NamedNoise& noise : named_noise(data)) {
    if (noise.name == "usbl") noise.sigmas[2] = 3;
    if (noise.name == "surge") noise.sigmas[0] = 0.5;
    if (noise.name == "odometry") noise.sigmas[5] = 6;
  }
  EXPECT_EQ(data.sensors[0].sigma, Vector<3>(0, 0, 3));
  EXPECT_EQ(data.noise.surge, 0.5);
  EXPECT_EQ(data.noise.odometry[5], 6.0);
}

TEST(NamedNoise, PlanarNonHolonomicNoiseHasNoHeave) {
  TrackingData planar;
  planar.planar = true;
  planar.noise = TrackingNoise(true);
  for (const NamedNoise& noise : named_noise(planar))
    if (noise.name == "non_holonomic") EXPECT_EQ(noise.sigmas.size(), 1u);
}

TEST(NamedNoise, RejectsInvalidStandardDeviations) {
  const auto reason = [](std::vector<double> values) { return why_invalid_sigmas(values, 2); };
  EXPECT_EQ(reason({1, 2}), "");
  EXPECT_EQ(reason({1}), "needs 2 standard deviations, not 1");
  EXPECT_THAT(reason({1, 0}), HasSubstr("standard deviation 0;"));
  EXPECT_THAT(reason({1, std::nan("")}), HasSubstr("standard deviation nan;"));
  EXPECT_THAT(reason({1, HUGE_VAL}), HasSubstr("standard deviation inf;"));
}

}  // namespace
}  // namespace tandem
