#include <cmath>

#include <gtest/gtest.h>

#include <tandem/solvers/planning/filter.hpp>

namespace tandem::testing {
namespace {

using detail::Filter;

TEST(Filter, TakesLessViolationForMoreCostAndTheOtherWayRound) {
  Filter filter;
  EXPECT_TRUE(filter.accept({1.0, 1.0}, {2.0, 0.5}, 1.0, 0.5));
  EXPECT_TRUE(filter.accept({2.0, 0.5}, {1.5, 0.9}, 1.0, 0.5));
  EXPECT_FALSE(filter.accept({1.5, 0.9}, {1.6, 0.95}, 1.0, 0.5));  // more of both
}

TEST(Filter, DoesNotComeBackToWhatWasLeft) {
  Filter filter;
  ASSERT_TRUE(filter.accept({1.0, 1.0}, {3.0, 0.1}, 1.0, 0.5));
  // Less cost than 3, and more violation than 0.1: but 1 and 1 was better.
  EXPECT_FALSE(filter.accept({3.0, 0.1}, {1.5, 1.0}, 1.0, 0.5));
  EXPECT_TRUE(filter.accept({3.0, 0.1}, {0.5, 1.0}, 1.0, 0.5));
}

TEST(Filter, NextToFeasibleTheCostHasToFallAsItsSlopeForetells) {
  Filter filter;
  EXPECT_FALSE(filter.accept({1.0, 1e-9}, {1.0, 0.0}, 1.0, -1.0));
  EXPECT_FALSE(filter.accept({1.0, 0.0}, {1.0 - 1e-5, 0.1}, 1.0, -1.0));
  EXPECT_TRUE(filter.accept({1.0, 0.0}, {1.0 - 1e-3, 0.1}, 1.0, -1.0));
  EXPECT_TRUE(filter.accept({1.0, 0.0}, {1.0 - 1e-5, 0.1}, 0.01, -1.0)) << "a short step has less to give";
  EXPECT_TRUE(filter.admits({1.0, 0.5})) << "what was left for its cost may be passed again";
}

TEST(Filter, TakesNothingThatIsNotFinite) {
  Filter filter;
  EXPECT_FALSE(filter.accept({1.0, 1.0}, {std::nan(""), 0.0}, 1.0, 0.0));
  EXPECT_FALSE(filter.accept({1.0, 1.0}, {0.0, HUGE_VAL}, 1.0, 0.0));
}

}  // namespace
}  // namespace tandem::testing
