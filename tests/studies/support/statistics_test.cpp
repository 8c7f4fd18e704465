#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include <tandem/studies/support/statistics.hpp>

namespace tandem {
namespace {

/// Reference values: printed tables of Student's t distribution, 97.5 %.
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
    EXPECT_NEAR(student_t_quantile(degrees, 0.975), t, 1e-5 * t) << degrees;
}

/// Reference values: printed tables.
TEST(StudyStatistics, QuantilesOfTheNormalDistributionAndOfChiSquared) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959964, 1e-6);
  EXPECT_NEAR(normal_quantile(0.5), 0, 1e-15);
  EXPECT_NEAR(chi_squared_quantile(1, 0.95), 3.841459, 1e-6);
  EXPECT_NEAR(chi_squared_quantile(6, 0.95), 12.591587, 1e-6);
  EXPECT_NEAR(chi_squared_quantile(60, 0.025), 40.482, 1e-3);
  EXPECT_THROW(chi_squared_quantile(1, 2), std::domain_error);
}

TEST(StudyStatistics, MeanOfFewSamples) {
  const auto mean = mean_interval({1, 2, 3, 4});
  ASSERT_TRUE(mean);
  EXPECT_DOUBLE_EQ(mean->value, 2.5);
  EXPECT_NEAR(mean->high - mean->value, 3.18245 * std::sqrt(5.0 / 3 / 4), 1e-5);
  EXPECT_FALSE(mean_interval({1}));
  EXPECT_FALSE(mean_interval({}));
}

/// Variation that both samples of a pair share does not widen the interval.
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

/// Reference values: tables of Wilson's interval, also for 20 of 20, where the normal approximation has zero width.
TEST(StudyStatistics, WilsonIntervalOfShares) {
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
