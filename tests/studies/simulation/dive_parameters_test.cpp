#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/simulation/dive_parameters.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

DiveOptions dive_with(std::initializer_list<std::pair<const char*, const char*>> settings) {
  DiveOptions options{.minutes = 3};
  for (const auto& [name, value] : settings)
    parameter_named(dive_parameters(), "a test", name).set(options, name, value);
  return options;
}

TEST(DiveParameters, DefaultsRoundTripAndBadValuesAreRejected) {
  for (const auto& parameter : dive_parameters()) {
    SCOPED_TRACE(parameter.name);
    DiveOptions options;
    parameter.set(options, parameter.name, parameter.text(DiveOptions()));
    for (const auto& other : dive_parameters()) EXPECT_EQ(other.text(options), other.text(DiveOptions()));
    EXPECT_FALSE(parameter.doc.empty());
  }
  EXPECT_THAT(error_of([] { dive_with({{"grade", "tacticle"}}); }), HasSubstr("did you mean tactical?"));
  EXPECT_THAT(error_of([] {
                simulate_dive(dive_with({{"dvl_outage", "300"}}));
              }),
              HasSubstr("dvl_outage must be 0 s or more and less than dvl_outage_period (240 s), not 300 s"));
}

/// An outage removes DVL readings and changes no other reading.
TEST(DiveParameters, OutageRemovesOnlyDvlReadings) {
  const SimulatedDive whole = simulate_dive(dive_with({}));
  const SimulatedDive out = simulate_dive(dive_with({{"dvl_outage", "20"}, {"dvl_outage_period", "60"}}));
  ASSERT_EQ(out.dvl_outages.size(), 3u);
  EXPECT_EQ(out.dvl_outages[1], std::pair(90.0, 110.0));
  for (std::size_t s = 0; s < whole.data.sensors.size(); ++s) {
    std::vector<EgoMeasurement> left = whole.data.sensors[s].measurements;
    if (whole.data.sensors[s].type == EgoSensorType::dvl)
      std::erase_if(left, [](const EgoMeasurement& m) { return std::fmod(m.t, 60) >= 30 && std::fmod(m.t, 60) < 50; });
    const auto& there = out.data.sensors[s].measurements;
    ASSERT_EQ(there.size(), left.size());
    for (std::size_t i = 0; i < left.size(); ++i) {
      EXPECT_EQ(there[i].t, left[i].t);
      EXPECT_EQ(there[i].value, left[i].value);
    }
  }
}

/// USBL fixes have the stated noise, and the target does not change the chaser's own sensors.
TEST(DiveParameters, TargetAddsUsblFixesWithStatedNoise) {
  DiveOptions options = dive_with({{"target", "1"}, {"usbl_sigma", "0.8"}, {"usbl_period", "0.5"}});
  options.minutes = 12;
  const SimulatedDive dive = simulate_dive(options);
  const auto& fixes = dive.tracking.sensors.at(0).measurements;
  ASSERT_NEAR(double(fixes.size()), 1440, 2);
  ASSERT_EQ(dive.truth_target.size(), dive.truth.size());
  double sum = 0;
  for (const Measurement& m : fixes) {
    const auto k = std::size_t(std::lround(m.t / 0.1));
    const SE3 chaser(dive.truth[k].value.rotation(), dive.truth[k].value.translation());
    sum += (m.position - chaser.inverse().act(dive.truth_target[k].value.translation())).squaredNorm();
  }
  const double count = 3 * double(fixes.size());
  EXPECT_NEAR(sum / count / (0.8 * 0.8), 1.0, 5 * std::sqrt(2 / count));
  EXPECT_EQ(dive.tracking.sensors[0].sigma, Eigen::VectorXd::Constant(3, 0.8));

  options.target = false;
  const SimulatedDive alone = simulate_dive(options);
  EXPECT_TRUE(alone.truth_target.empty());
  EXPECT_EQ(alone.data.imu->samples.back().specific_force, dive.data.imu->samples.back().specific_force);
}

}  // namespace
}  // namespace tandem
