#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include <tandem/solvers/calibration/flat_range.hpp>

namespace tandem::testing {
namespace {

using detail::Along;
using detail::FunctionRef;

/// Around 0 as found, over factors of 1000 at most.
CalibratedNoise told(FunctionRef<Along(double)> evidence) {
  CalibratedNoise noise;
  detail::flat_range(0, evidence(0), 0.5, std::log(1e3), evidence).tell(noise, 0);
  return noise;
}

TEST(FlatRange, EndsWhereTheEvidenceFalls) {
  const CalibratedNoise noise = told([](double x) { return Along{-2 * x * x, -4 * x}; });
  EXPECT_TRUE(noise.determined);
  EXPECT_NEAR(std::log(noise.flat_from), -1, 1e-6);
  EXPECT_NEAR(std::log(noise.flat_to), 1, 1e-6);
}

TEST(FlatRange, AMesaIsTold) {
  const CalibratedNoise noise = told([](double x) {
    const double beyond = std::max(std::abs(x) - 1, 0.0);
    return Along{-0.1 * x * x - 20 * beyond * beyond, -0.2 * x - std::copysign(40 * beyond, x)};
  });
  EXPECT_TRUE(noise.determined) << "all but level in between, and it falls either way";
}

TEST(FlatRange, FromOneSideItIsBoundedWhereThatExcludesWhatWasGiven) {
  for (const auto& [most, bounded] : {std::pair(2.0, false), {6.0, true}}) {
    const CalibratedNoise noise = told([most = most](double x) {
      return Along{-most * std::exp(-x), most * std::exp(-x)};
    });
    EXPECT_FALSE(noise.determined);
    EXPECT_EQ(noise.bounded, bounded);
    EXPECT_EQ(noise.flat_from > 1, bounded);
  }
}

/// No data have spoken where a problem cannot be solved.
TEST(FlatRange, TheEndOfTheEvidenceTellsNothing) {
  const CalibratedNoise noise = told([](double x) { return Along{std::abs(x) > 0.3 ? -HUGE_VAL : 0.0, 0}; });
  EXPECT_FALSE(noise.determined || noise.bounded);
  EXPECT_LE(std::log(noise.flat_to), 0.3);
}

TEST(FlatRange, ToldIsWhatDataSayAtLeastAsWellAsThePrior) {
  EXPECT_TRUE(detail::is_told(4.1, 0.5));
  EXPECT_FALSE(detail::is_told(3.9, 0.5));
  EXPECT_FALSE(detail::is_told(0.01, 0)) << "of nothing known before, a factor of ten";
  EXPECT_TRUE(detail::is_told(1, 0));
}

}  // namespace
}  // namespace tandem::testing
