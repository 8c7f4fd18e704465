#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/mixed_velocity.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class States>
class MixedVelocityTest : public ::testing::Test {};
template <class... Xs>
MixedVelocity<Xs...> constant_over(std::tuple<Xs...>, double dt1, double dt2) {
  return MixedVelocity<Xs...>::constant(dt1, dt2);
}
template <int n>
Vector<n> halved(double slowest) {
  Vector<n> tau;
  for (int i = 0; i < n; ++i) tau[i] = slowest / double(1 << i);
  return tau;
}
template <class... Xs>
MixedVelocity<Xs...> damped_over(std::tuple<Xs...>, double dt1, double dt2, double slowest) {
  return MixedVelocity<Xs...>::damped(dt1, dt2, halved<MixedVelocity<Xs...>::dim>(slowest));
}
using Triples = ::testing::Types<std::tuple<R3, R3, R3>, std::tuple<R3, R3, SE3>, std::tuple<R3, SE3, R3>,
                                 std::tuple<SE3, R3, R3>, std::tuple<SE3, SE3, R3>, std::tuple<SE3, R3, SE3>,
                                 std::tuple<R3, SE3, SE3>, std::tuple<SE3, SE3, SE3>, std::tuple<SE2, R2, SE2>>;
TYPED_TEST_SUITE(MixedVelocityTest, Triples);

TYPED_TEST(MixedVelocityTest, MatchesTwistResidualsOfThePositions) {
  constexpr int n = std::tuple_element_t<0, TypeParam>::point_dim;
  std::mt19937_64 random(3);
  for (int i = 0; i < 20; ++i) {
    const auto states = random_states<TypeParam>(random, StateDistance(i % 4));
    Vector<n> constant, of_points, damped, damped_points, never;
    std::apply(
        [&](const auto&... x) {
          constant_over(states, 0.8, 1.3)(x..., constant);
          ConstantTwist<Rn<n>>{0.8, 1.3}(Rn<n>(x.translation())..., of_points);
          damped_over(states, 0.8, 1.3, 5.0)(x..., damped);
          DampedTwist<Rn<n>>::over(0.8, 1.3, halved<n>(5.0))(Rn<n>(x.translation())..., damped_points);
          damped_over(states, 0.8, 1.3, HUGE_VAL)(x..., never);
        },
        states);
    EXPECT_LE((constant - of_points).norm(), 1e-15 * (1.0 + of_points.norm()));
    EXPECT_LE((damped - damped_points).norm(), 1e-14 * (1.0 + damped_points.norm()));
    EXPECT_EQ(never, constant);
  }
}

TYPED_TEST(MixedVelocityTest, HasCorrectJacobians) {
  expect_correct_jacobians_at_random_states(constant_over(TypeParam(), 1.0, 1.0), 1);
  expect_correct_jacobians_at_random_states(constant_over(TypeParam(), 0.8, 1.3), 2);
  expect_correct_jacobians_at_random_states(damped_over(TypeParam(), 1.0, 1.0, 60.0), 3);
  expect_correct_jacobians_at_random_states(damped_over(TypeParam(), 0.8, 1.3, 2.0), 4);
}

TEST(MixedVelocity, EqualsConstantTwistForPoints) {
  const R3 x0(Vector<3>(1.0, 2.0, 3.0)), x1(Vector<3>(2.0, 4.0, 2.0)), x2(Vector<3>(8.0, -1.0, 0.5));
  Vector<3> r, expected;
  std::array<Matrix<3, 3>, 3> J, K;
  MixedVelocity<R3, R3, R3>::constant(2.0, 3.0)(x0, x1, x2, r, &J[0], &J[1], &J[2]);
  ConstantTwist<R3>{2.0, 3.0}(x0, x1, x2, expected, &K[0], &K[1], &K[2]);
  EXPECT_EQ(r, expected);
  EXPECT_EQ(J, K);
  EXPECT_EQ(r, Vector<3>(4.5, -8.0, 0.0));
}

}  // namespace
}  // namespace tandem::testing
