// Every Jacobian of operations.hpp against dual numbers that are propagated through the group's own code.

#include <concepts>

#include <gtest/gtest.h>

#include "dual_numbers.hpp"

namespace tandem {
namespace {

static_assert(Over<SE3::Rebind<Jet>, SE3> && Over<PoseBundle::Rebind<Jet>, PoseBundle>);
static_assert(std::same_as<SE23::Rebind<Jet>, BasicSE23<Jet>> && !Over<SE2::Rebind<Jet>, SE3>);

TYPED_TEST_SUITE(DualNumbers, BasicGroups);
TYPED_TEST(DualNumbers, MatchAllJacobians) { this->run(); }

}  // namespace
}  // namespace tandem
