#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/prior.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class G>
class PriorTest : public ::testing::Test {};
using PriorGroups = ::testing::Types<SE3, SE2, SO3, SO2, SE23, Rn<3>>;
TYPED_TEST_SUITE(PriorTest, PriorGroups);

TYPED_TEST(PriorTest, IsLogOfTheDifference) {
  using G = TypeParam;
  const Prior<G> prior{G::Exp(tangent<G>(1.2, 5.0))};
  for (const auto& e : residual_sizes<G>()) {
    const G x = prior.z * G::Exp(e);
    typename G::Tangent r;
    prior(x, r);
    EXPECT_LE(difference(e, r), 1e-14);
    EXPECT_LE(difference(plain(x), plain(prior.z) * expm<G>(r)), 1e-14);
  }
}

TYPED_TEST(PriorTest, HasCorrectJacobian) {
  using G = TypeParam;
  const Prior<G> prior{G::Exp(tangent<G>(1.2, 5.0))};
  for (const auto& e : residual_sizes<G>()) expect_correct_jacobians(prior, G(prior.z * G::Exp(e)));
  expect_correct_jacobians_at_random_states(prior, 1);
  expect_correct_jacobians_at_random_states(Prior<G>{}, 2);
}

}  // namespace
}  // namespace tandem::testing
