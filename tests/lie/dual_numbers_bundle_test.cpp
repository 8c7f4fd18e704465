// As dual_numbers_test.cpp, for products of groups; apart because both compile slowly.

#include <gtest/gtest.h>

#include "dual_numbers.hpp"

namespace tandem {
namespace {

TYPED_TEST_SUITE(DualNumbers, Bundles);
TYPED_TEST(DualNumbers, ThroughEveryOperation) { this->run(); }

}  // namespace
}  // namespace tandem
