// Same test as in dual_numbers_test.cpp, for bundles. In a separate file because both compile slowly.

#include <gtest/gtest.h>

#include "dual_numbers.hpp"

namespace tandem {
namespace {

template <class G>
class DualNumbersInBundles : public DualNumbers<G> {};

TYPED_TEST_SUITE(DualNumbersInBundles, Bundles);
TYPED_TEST(DualNumbersInBundles, MatchAllJacobians) { this->run(); }

}  // namespace
}  // namespace tandem
