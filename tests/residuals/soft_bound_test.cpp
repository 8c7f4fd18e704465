#include <limits>

#include <gtest/gtest.h>

#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/soft_bound.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Returns the soft bound of x ∈ R³, which is the residual of a prior at the origin.
Vector<3> outside(const Bounds<3>& bounds, const Vector<3>& x, Matrix<3, 3>* J = nullptr) {
  Vector<3> r;
  SoftBound{Prior<R3>{}, bounds}(R3(x), r, J);
  return r;
}

TEST(SoftBound, IsDistanceToTheBounds) {
  const Bounds<3> bounds{Vector<3>(-1.0, -infinity, 2.0), Vector<3>(1.0, 5.0, infinity)};
  EXPECT_EQ(outside(bounds, Vector<3>(0.0, 0.0, 3.0)), Vector<3>(0.0, 0.0, 0.0));
  EXPECT_EQ(outside(bounds, Vector<3>(1.0, 5.0, 2.0)), Vector<3>(0.0, 0.0, 0.0));
  EXPECT_EQ(outside(bounds, Vector<3>(-3.0, 5.5, 1.0)), Vector<3>(-2.0, 0.5, -1.0));
  EXPECT_EQ(outside(bounds, Vector<3>(3.0, -1e9, 1e9)), Vector<3>(2.0, 0.0, 0.0));
}

TEST(SoftBound, JacobianIsZeroInsideTheBounds) {
  Matrix<3, 3> J;
  outside(between(-1.0, 1.0), Vector<3>(0.5, 2.0, -2.0), &J);
  EXPECT_EQ(J, (Matrix<3, 3>(Vector<3>(0.0, 1.0, 1.0).asDiagonal())));
}

TEST(SoftBound, EqualityGivesTheDifference) {
  EXPECT_EQ(outside(equal_to(0.5), Vector<3>(0.5, 2.0, -2.0)), Vector<3>(0.0, 1.5, -2.5));
}

TEST(SoftBound, SupportsOneSidedBounds) {
  EXPECT_EQ(outside(at_least(1.0), Vector<3>(0.5, 2.0, 1e300)), Vector<3>(-0.5, 0.0, 0.0));
  EXPECT_EQ(outside(at_most(1.0), Vector<3>(0.5, 2.0, -1e300)), Vector<3>(0.0, 1.0, 0.0));
}

TEST(SoftBound, PropagatesNan) {
  EXPECT_TRUE(std::isnan(outside(between(-1.0, 1.0), Vector<3>(std::nan(""), 0.0, 0.0))[0]));
}

TEST(SoftBound, HasCorrectJacobians) {
  // At random states some rows are inside and some outside the bounds, but none lies on a bound, where the residual is
  // not differentiable.
  const SoftBound limits{TwistComponents<SE3, surge | sway | yaw_rate>{0.5}, between(-1.0, 0.75)};
  expect_correct_jacobians_at_random_states(limits, 3);
  expect_correct_jacobians_at_random_states(SoftBound{TwistComponents<SE2, surge | yaw_rate>{0.5}, at_most(0.1)}, 4);
  expect_correct_jacobians_at_random_states(
      SoftBound{UsblPosition<SE3, R3>{Vector<3>(1.0, 2.3, 3.0)}, between(-2.0, 2.5)}, 5);
  expect_correct_jacobians_at_random_states(SoftBound{RelativePose<>{}, at_least(0.3)}, 6);
}

TEST(SoftBound, HasNameAndStatesOfTheResidual) {
  using Limits = SoftBound<TwistComponents<SE3, surge>>;
  static_assert(Residual<Limits> && Limits::dim == 1);
  EXPECT_EQ(Limits::name, (TwistComponents<SE3, surge>::name));
}

}  // namespace
}  // namespace tandem::testing
