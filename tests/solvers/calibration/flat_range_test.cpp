#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include <tandem/solvers/calibration/flat_range.hpp>

namespace tandem::testing {
namespace {

using detail::FunctionRef;
using detail::ProfilePoint;

/// Returns the range around an estimate of 0, for factors up to 1000.
CalibratedNoise range_of(FunctionRef<ProfilePoint(double)> evidence) {
  CalibratedNoise noise;
  detail::flat_range(0, evidence(0), 0.5, std::log(1e3), evidence).assign_to(noise, 0);
  return noise;
}

TEST(FlatRange, EndsWhereTheEvidenceFallsByTwo) {
  const CalibratedNoise noise = range_of([](double x) { return ProfilePoint{-2 * x * x, -4 * x}; });
  EXPECT_TRUE(noise.identifiable);
  EXPECT_NEAR(std::log(noise.flat_from), -1, 1e-6);
  EXPECT_NEAR(std::log(noise.flat_to), 1, 1e-6);
}

TEST(FlatRange, APlateauWithSteepEdgesIsIdentifiable) {
  const CalibratedNoise noise = range_of([](double x) {
    const double beyond = std::max(std::abs(x) - 1, 0.0);
    return ProfilePoint{-0.1 * x * x - 20 * beyond * beyond, -0.2 * x - std::copysign(40 * beyond, x)};
  });
  EXPECT_TRUE(noise.identifiable) << "nearly flat inside, but it falls on both sides";
}

TEST(FlatRange, IsBoundedOnOneSideIfThatExcludesTheGivenValue) {
  for (const auto& [drop, bounded] : {std::pair(2.0, false), {6.0, true}}) {
    const CalibratedNoise noise = range_of([drop = drop](double x) {
      return ProfilePoint{-drop * std::exp(-x), drop * std::exp(-x)};
    });
    EXPECT_FALSE(noise.identifiable);
    EXPECT_EQ(noise.bounded, bounded);
    EXPECT_EQ(noise.flat_from > 1, bounded);
  }
}

/// Points at which the problem cannot be solved do not bound the range.
TEST(FlatRange, IsNotBoundedWhereThereIsNoEvidence) {
  const CalibratedNoise noise = range_of([](double x) { return ProfilePoint{std::abs(x) > 0.3 ? -HUGE_VAL : 0.0, 0}; });
  EXPECT_FALSE(noise.identifiable || noise.bounded);
  EXPECT_LE(std::log(noise.flat_to), 0.3);
}

TEST(FlatRange, IsIdentifiableIfTheDataConstrainItAsWellAsThePrior) {
  EXPECT_TRUE(detail::is_identifiable(4.1, 0.5));
  EXPECT_FALSE(detail::is_identifiable(3.9, 0.5));
  EXPECT_FALSE(detail::is_identifiable(0.01, 0)) << "without a prior, a factor of ten counts";
  EXPECT_TRUE(detail::is_identifiable(1, 0));
}

}  // namespace
}  // namespace tandem::testing
