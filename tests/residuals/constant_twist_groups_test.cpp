#include <gtest/gtest.h>

#include <tandem/lie/sek3.hpp>

#include "residuals/constant_twist_checks.hpp"

namespace tandem::testing {
namespace {

INSTANTIATE_TYPED_TEST_SUITE_P(SO3, ConstantTwistTest, SO3);
INSTANTIATE_TYPED_TEST_SUITE_P(SE23, ConstantTwistTest, SE23);

}  // namespace
}  // namespace tandem::testing
