#include <cmath>

#include <gtest/gtest.h>

#include <tandem/solvers/replanning/filter.hpp>

namespace tandem::testing {
namespace {

using detail::Filter;

TEST(Filter, AcceptsLessViolationOrLessCost) {
  Filter filter;
  EXPECT_TRUE(filter.accept({1.0, 1.0}, {2.0, 0.5}, 1.0, 0.5));
  EXPECT_TRUE(filter.accept({2.0, 0.5}, {1.5, 0.9}, 1.0, 0.5));
  EXPECT_FALSE(filter.accept({1.5, 0.9}, {1.6, 0.95}, 1.0, 0.5));  // more of both
}

TEST(Filter, RejectsPointsThatDoNotImproveOnStoredOnes) {
  Filter filter;
  ASSERT_TRUE(filter.accept({1.0, 1.0}, {3.0, 0.1}, 1.0, 0.5));
  // Better than (3, 0.1) by its cost, but not better than the stored point (1, 1).
  EXPECT_FALSE(filter.accept({3.0, 0.1}, {1.5, 1.0}, 1.0, 0.5));
  EXPECT_TRUE(filter.accept({3.0, 0.1}, {0.5, 1.0}, 1.0, 0.5));
}

TEST(Filter, RequiresThePredictedDecreaseNearFeasiblePoints) {
  Filter filter;
  EXPECT_FALSE(filter.accept({1.0, 1e-9}, {1.0, 0.0}, 1.0, -1.0));
  EXPECT_FALSE(filter.accept({1.0, 0.0}, {1.0 - 1e-5, 0.1}, 1.0, -1.0));
  EXPECT_TRUE(filter.accept({1.0, 0.0}, {1.0 - 1e-3, 0.1}, 1.0, -1.0));
  EXPECT_TRUE(filter.accept({1.0, 0.0}, {1.0 - 1e-5, 0.1}, 0.01, -1.0)) << "a short step predicts a small decrease";
  EXPECT_TRUE(filter.admits({1.0, 0.5})) << "an improvement of the cost stores no point";
}

/// Far from feasible, less violation is sufficient for any predicted decrease of the cost.
TEST(Filter, AcceptsLessViolationFarFromFeasiblePoints) {
  Filter filter;
  EXPECT_TRUE(filter.accept({0.0, 5.0}, {1e-3, 1e-3}, 1.0, -10.0));
  filter.start(1e5);
  EXPECT_TRUE(filter.accept({0.0, 50.0}, {1e-3, 1e-3}, 1.0, -100.0));
  EXPECT_FALSE(filter.accept({0.0, 5.0}, {1e-3, 1e-3}, 1.0, -10.0)) << "5 is nearly feasible if 1e5 was the start";
}

TEST(Filter, RejectsTooMuchViolationForAnyCost) {
  Filter filter;
  filter.start(0.0);
  EXPECT_FALSE(filter.accept({1.0, 1.0}, {-1e9, 1e5}, 1.0, 0.0));
}

TEST(Filter, RejectsPointsThatAreNotFinite) {
  Filter filter;
  EXPECT_FALSE(filter.accept({1.0, 1.0}, {std::nan(""), 0.0}, 1.0, 0.0));
  EXPECT_FALSE(filter.accept({1.0, 1.0}, {0.0, HUGE_VAL}, 1.0, 0.0));
}

}  // namespace
}  // namespace tandem::testing
