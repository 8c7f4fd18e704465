#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>

#include "residuals/damped_twist_checks.hpp"

namespace tandem::testing {
namespace {

using PoseAndSlide = Bundle<SE2, Rn<1>>;

INSTANTIATE_TYPED_TEST_SUITE_P(SO3, DampedTwistTest, SO3);
INSTANTIATE_TYPED_TEST_SUITE_P(SE23, DampedTwistTest, SE23);
INSTANTIATE_TYPED_TEST_SUITE_P(BundleOfSE2AndR1, DampedTwistTest, PoseAndSlide);

}  // namespace
}  // namespace tandem::testing
