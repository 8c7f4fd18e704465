#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/so3.hpp>

#include "residuals/white_noise_acceleration_checks.hpp"

/// More groups than in white_noise_acceleration_test.cpp, in a separate file because both compile slowly.
namespace tandem::testing {
namespace {

INSTANTIATE_TYPED_TEST_SUITE_P(SE2, WhiteNoiseAccelerationTest, SE2);
INSTANTIATE_TYPED_TEST_SUITE_P(SO3, WhiteNoiseAccelerationTest, SO3);
INSTANTIATE_TYPED_TEST_SUITE_P(R3, WhiteNoiseAccelerationTest, R3);

using PlanarAndHeave = Bundle<SE2, Rn<1>>;
TEST(WhiteNoiseAcceleration, BundleHasCorrectJacobians) {
  expect_correct_jacobians_at_random_states(WhiteNoiseAcceleration<PlanarAndHeave>{0.8}, 2, 12);
}

}  // namespace
}  // namespace tandem::testing
