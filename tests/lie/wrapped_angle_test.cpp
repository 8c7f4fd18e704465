#include <numbers>

#include <gtest/gtest.h>

#include <tandem/lie/wrapped_angle.hpp>

namespace tandem {
namespace {

TEST(WrappedAngle, DiffersByWholeTurns) {
  constexpr double pi = std::numbers::pi;
  EXPECT_EQ(wrapped_angle(0.3), 0.3);
  EXPECT_NEAR(wrapped_angle(7 * pi + 0.25), -pi + 0.25, 1e-14);
  EXPECT_NEAR(wrapped_angle(-4 * pi - 1), -1, 1e-14);
}

}  // namespace
}  // namespace tandem
