#include <cmath>

#include <gtest/gtest.h>

#include <tandem/studies/support/statistics.hpp>

namespace tandem {
namespace {

/// Printed tables of Student's t, 97.5 %.
TEST(StudyStatistics, QuantilesOfStudentsT) {
  for (const auto& [degrees, t] : {std::pair{1, 12.7062},
                                   {2, 4.30265},
                                   {3, 3.18245},
                                   {4, 2.77645},
                                   {5, 2.57058},
                                   {9, 2.26216},
                                   {19, 2.09302},
                                   {49, 2.00958},
                                   {99, 1.98422},
                                   {100000, 1.95999}})
    EXPECT_NEAR(t_quantile_975(std::size_t(degrees)), t, 2e-4 * t) << degrees;
}

TEST(StudyStatistics, MeanOfFew) {
  const auto mean = mean_interval({1, 2, 3, 4});
  ASSERT_TRUE(mean);
  EXPECT_DOUBLE_EQ(mean->value, 2.5);
  EXPECT_NEAR(mean->high - mean->value, 3.18245 * std::sqrt(5.0 / 3 / 4), 1e-3);
  EXPECT_FALSE(mean_interval({1}));
  EXPECT_FALSE(mean_interval({}));
}

/// What two have in common does not count.
TEST(StudyStatistics, RatioOfPairs) {
  const std::vector<double> a = {1, 2, 3, 4}, b = {1.1, 2.2, 3.3, 4.4};
  const auto exact = ratio_interval(a, b);
  ASSERT_TRUE(exact);
  EXPECT_NEAR(exact->value, 1.1, 1e-15);
  EXPECT_NEAR(exact->high - exact->low, 0, 1e-14);
  const auto loose = ratio_interval(a, {4.4, 3.3, 2.2, 1.1});
  EXPECT_GT(loose->high - loose->low, 1);
  EXPECT_FALSE(ratio_interval({0, 0}, {1, 2}));
}

/// Wilson 1927 as tabulated, and where the plain interval would have no width.
TEST(StudyStatistics, Shares) {
  const auto half = share_interval(5, 10);
  EXPECT_NEAR(half->low, 0.2366, 1e-4);
  EXPECT_NEAR(half->high, 0.7634, 1e-4);
  const auto all = share_interval(20, 20);
  EXPECT_NEAR(all->low, 0.8389, 1e-4);
  EXPECT_NEAR(all->high, 1.0, 1e-12);
  EXPECT_FALSE(share_interval(0, 0));
}

}  // namespace
}  // namespace tandem
