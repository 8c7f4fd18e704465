#include <random>

#include <gtest/gtest.h>

#include "solvers/fixed_lag/fixed_lag_calls.hpp"

namespace tandem::testing {
namespace {

TEST(FixedLagCalls, RandomCallsMatchTheModel) {
  std::mt19937 random(7);
  std::vector<std::uint8_t> bytes(600);
  for (int run = 0; run < 400; ++run) {
    for (auto& b : bytes) b = std::uint8_t(random());
    const auto wrong = fixed_lag_calls(bytes);
    ASSERT_FALSE(wrong) << "run " << run << ", " << *wrong;
  }
}

}  // namespace
}  // namespace tandem::testing
