#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/relative_rotation.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class G>
class RelativeRotationTest : public ::testing::Test {
 protected:
  using R = typename G::Rotation;
  const RelativeRotation<G> residual{R::Exp(tangent<R>(0.8, 1.0)), R::Exp(tangent<R>(2.1, 1.0)),
                                     R::Exp(tangent<R>(-1.4, 1.0))};
  const G x = G::Exp(tangent<G>(1.9, 30.0));
};
using RelativeRotationGroups = ::testing::Types<SE3, SE2, SE23>;
TYPED_TEST_SUITE(RelativeRotationTest, RelativeRotationGroups);

TYPED_TEST(RelativeRotationTest, IsLogOfItsDefinition) {
  using R = typename TypeParam::Rotation;
  for (const auto& e : residual_sizes<R>()) {
    const R y = this->x.rotation() * this->residual.B * this->residual.z * R::Exp(e) * this->residual.F.inverse();
    typename TypeParam::Tangent turn = TypeParam::Tangent::Zero();
    turn.template tail<R::dof>() = y.Log();
    typename R::Tangent r;
    this->residual(this->x, TypeParam::Exp(turn), r);
    EXPECT_LE(difference(e, r), 1e-14);
  }
}

TYPED_TEST(RelativeRotationTest, HasCorrectJacobians) {
  using G = TypeParam;
  for (const auto& e : residual_sizes<G>())
    expect_correct_jacobians(RelativeRotation<G>{}, this->x, this->x * G::Exp(e));
  expect_correct_jacobians_at_random_states(RelativeRotation<G>{}, 1);
  expect_correct_jacobians_at_random_states(this->residual, 2);
}

TEST(RelativeRotation, EqualsTheOrientationRowsOfRelativePose) {
  std::mt19937_64 random(3);
  const SE3 z = SE3::Exp(tangent<SE3>(0.8, 4.0)), B = SE3::Exp(tangent<SE3>(2.1, 0.6)),
            F = SE3::Exp(tangent<SE3>(1, 1));
  for (int i = 0; i < 20; ++i) {
    const auto [x, y] = random_states<std::tuple<SE3, SE3>>(random, StateDistance(i % 4));
    Vector<6> pose;
    Vector<3> rotation;
    RelativePose<>{z, B, F}(x, y, pose);
    RelativeRotation<>{z.rotation(), B.rotation(), F.rotation()}(x, y, rotation);
    EXPECT_LE((pose.tail<3>() - rotation).norm(), 1e-14);
  }
}

TEST(RelativeRotation, MatchesHandCalculation) {
  // The target is rotated by 30° to the left of the chaser; the measurement is 50°.
  const double degree = std::numbers::pi / 180;
  Vector<1> r;
  RelativeRotation<SE2>{SO2(50 * degree)}(SE2(SO2(100 * degree), Vector<2>(1.0, 2.0)),
                                          SE2(SO2(130 * degree), Vector<2>(7.0, 2.0)), r);
  EXPECT_NEAR(r[0], -20 * degree, 1e-15);
}

}  // namespace
}  // namespace tandem::testing
