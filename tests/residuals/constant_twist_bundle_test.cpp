#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>

#include "residuals/constant_twist_checks.hpp"

namespace tandem::testing {
namespace {

using PoseAndVelocity = Bundle<SE3, Rn<3>>;

INSTANTIATE_TYPED_TEST_SUITE_P(BundleOfSE3AndR3, ConstantTwistTest, PoseAndVelocity);

TEST(ConstantTwistBundle, MatchesTheResidualsOfItsParts) {
  std::mt19937_64 random(4);
  const auto [x0, x1, x2] =
      random_states<std::tuple<PoseAndVelocity, PoseAndVelocity, PoseAndVelocity>>(random, StateDistance::large);
  Vector<9> r;
  Matrix<9, 9> J0;
  ConstantTwist<PoseAndVelocity>{1.0, 0.6}(x0, x1, x2, r, &J0);
  Vector<6> pose;
  Matrix<6, 6> J_pose;
  ConstantTwist<SE3>{1.0, 0.6}(x0.get<0>(), x1.get<0>(), x2.get<0>(), pose, &J_pose);
  Vector<3> velocity;
  Matrix<3, 3> J_velocity;
  ConstantTwist<R3>{1.0, 0.6}(x0.get<1>(), x1.get<1>(), x2.get<1>(), velocity, &J_velocity);
  Matrix<9, 9> expected = Matrix<9, 9>::Zero();
  expected.topLeftCorner<6, 6>() = J_pose;
  expected.bottomRightCorner<3, 3>() = J_velocity;
  EXPECT_LE(difference(pose, r.head<6>()), 1e-14);
  EXPECT_LE(difference(velocity, r.tail<3>()), 1e-14);
  EXPECT_LE(difference(expected, J0), 1e-14);
}

}  // namespace
}  // namespace tandem::testing
