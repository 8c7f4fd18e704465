#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/damped_velocity.hpp>
#include <tandem/residuals/mixed_constant_velocity.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class States>
class DampedVelocityTest : public ::testing::Test {};
template <class... Xs>
DampedVelocity<Xs...> damped_over(std::tuple<Xs...>, double dt1, double dt2, double slowest) {
  Vector<DampedVelocity<Xs...>::dim> tau;
  for (Eigen::Index i = 0; i < tau.size(); ++i) tau[i] = slowest / double(1 << i);
  return DampedVelocity<Xs...>::over(dt1, dt2, tau);
}
template <class... Xs>
MixedConstantVelocity<Xs...> constant_over(std::tuple<Xs...>, double dt1, double dt2) {
  return {dt1, dt2};
}
using DampedTriples = ::testing::Types<std::tuple<R3, R3, R3>, std::tuple<R3, R3, SE3>, std::tuple<SE3, R3, R3>,
                                       std::tuple<SE3, R3, SE3>, std::tuple<SE3, SE3, SE3>, std::tuple<SE2, R2, SE2>>;
TYPED_TEST_SUITE(DampedVelocityTest, DampedTriples);

TYPED_TEST(DampedVelocityTest, is_damped_twist_of_the_positions) {
  constexpr int n = std::tuple_element_t<0, TypeParam>::point_dim;
  std::mt19937_64 random(3);
  for (int i = 0; i < 20; ++i) {
    const auto states = random_states<TypeParam>(random, Spread(i % 4));
    Vector<n> mixed, points, constant, never;
    std::apply(
        [&](const auto&... x) {
          Vector<n> tau;
          for (int j = 0; j < n; ++j) tau[j] = 5.0 / double(1 << j);
          damped_over(states, 0.8, 1.3, 5.0)(x..., mixed);
          DampedTwist<Rn<n>>::over(0.8, 1.3, tau)(Rn<n>(x.translation())..., points);
          damped_over(states, 0.8, 1.3, HUGE_VAL)(x..., never);
          constant_over(states, 0.8, 1.3)(x..., constant);
        },
        states);
    EXPECT_LE((mixed - points).norm(), 1e-14 * (1.0 + points.norm()));
    EXPECT_LE((never - constant).norm(), 1e-15 * (1.0 + constant.norm()));
  }
}

TYPED_TEST(DampedVelocityTest, has_the_right_jacobians) {
  expect_right_jacobians_at_random(damped_over(TypeParam(), 1.0, 1.0, 60.0), 1);
  expect_right_jacobians_at_random(damped_over(TypeParam(), 0.8, 1.3, 2.0), 2);
}

}  // namespace
}  // namespace tandem::testing
