#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/mixed_constant_velocity.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class States>
class MixedConstantVelocityTest : public ::testing::Test {};
template <class... Xs>
MixedConstantVelocity<Xs...> over(std::tuple<Xs...>, double dt1, double dt2) {
  return {dt1, dt2};
}
using Triples = ::testing::Types<std::tuple<R3, R3, R3>, std::tuple<R3, R3, SE3>, std::tuple<R3, SE3, R3>,
                                 std::tuple<SE3, R3, R3>, std::tuple<SE3, SE3, R3>, std::tuple<SE3, R3, SE3>,
                                 std::tuple<R3, SE3, SE3>, std::tuple<SE3, SE3, SE3>, std::tuple<SE2, R2, SE2>>;
TYPED_TEST_SUITE(MixedConstantVelocityTest, Triples);

TYPED_TEST(MixedConstantVelocityTest, is_constant_twist_of_the_positions) {
  constexpr int n = std::tuple_element_t<0, TypeParam>::point_dim;
  std::mt19937_64 random(3);
  for (int i = 0; i < 20; ++i) {
    const auto states = random_states<TypeParam>(random, Spread(i % 4));
    Vector<n> mixed, points;
    std::apply(
        [&](const auto&... x) {
          over(states, 0.8, 1.3)(x..., mixed);
          ConstantTwist<Rn<n>>{0.8, 1.3}(Rn<n>(x.translation())..., points);
        },
        states);
    EXPECT_LE((mixed - points).norm(), 1e-15 * (1.0 + points.norm()));
  }
}

TYPED_TEST(MixedConstantVelocityTest, has_the_right_jacobians) {
  expect_right_jacobians_at_random(over(TypeParam(), 1.0, 1.0), 1);
  expect_right_jacobians_at_random(over(TypeParam(), 0.8, 1.3), 2);
}

TEST(MixedConstantVelocity, of_points_has_the_jacobians_of_constant_twist) {
  const R3 x0(Vector<3>(1.0, 2.0, 3.0)), x1(Vector<3>(2.0, 4.0, 2.0)), x2(Vector<3>(8.0, -1.0, 0.5));
  Vector<3> r, expected;
  std::array<Matrix<3, 3>, 3> J, K;
  MixedConstantVelocity<R3, R3, R3>{2.0, 3.0}(x0, x1, x2, r, &J[0], &J[1], &J[2]);
  ConstantTwist<R3>{2.0, 3.0}(x0, x1, x2, expected, &K[0], &K[1], &K[2]);
  EXPECT_EQ(r, expected);
  EXPECT_EQ(J, K);
  EXPECT_EQ(r, Vector<3>(4.5, -8.0, 0.0));
}

}  // namespace
}  // namespace tandem::testing
