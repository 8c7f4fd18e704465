#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <tandem/problem/quantile.hpp>

namespace tandem::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Reference values: quantile(x, p, type = 7) of R.
TEST(Quantile, InterpolatesBetweenOrderStatistics) {
  const std::vector<double> x = {7, 1, 3, 10};
  EXPECT_DOUBLE_EQ(quantile(x, 0), 1);
  EXPECT_DOUBLE_EQ(quantile(x, 0.25), 2.5);
  EXPECT_DOUBLE_EQ(quantile(x, 0.5), 5);
  EXPECT_DOUBLE_EQ(quantile(x, 0.9), 9.1);
  EXPECT_DOUBLE_EQ(quantile(x, 1), 10);
  EXPECT_DOUBLE_EQ(quantile({4}, 0.3), 4);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(Quantile, AllowsInfiniteValues) {
  EXPECT_EQ(quantile({kInfinity, kInfinity}, 0.5), kInfinity);
  EXPECT_EQ(quantile({1, kInfinity}, 0.5), kInfinity);
  EXPECT_EQ(quantile({1, 2, kInfinity}, 0.5), 2);
}

TEST(Quantile, MedianOfAnEvenNumberIsTheMeanOfTheMiddleTwo) {
  EXPECT_DOUBLE_EQ(median({4, 1, 3, 2}), 2.5);
  EXPECT_DOUBLE_EQ(median({5, 1, 3}), 3);
}

TEST(Quantile, MedianStepOfTimes) {
  EXPECT_DOUBLE_EQ(median_step({0, 1, 3, 4}), 1);
  EXPECT_DOUBLE_EQ(median_step({0, 1, 3}), 1.5);
  EXPECT_EQ(median_step({2}), 0);
}

}  // namespace
}  // namespace tandem::detail
