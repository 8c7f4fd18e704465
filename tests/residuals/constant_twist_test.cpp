#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/constant_twist.hpp>

#include "residuals/constant_twist_checks.hpp"

namespace tandem::testing {
namespace {

INSTANTIATE_TYPED_TEST_SUITE_P(SE3, ConstantTwistTest, SE3);
INSTANTIATE_TYPED_TEST_SUITE_P(SE2, ConstantTwistTest, SE2);
INSTANTIATE_TYPED_TEST_SUITE_P(R3, ConstantTwistTest, R3);

TEST(ConstantTwist, IsConstantVelocityForPoints) {
  const Vector<3> x0(1.0, 2.0, 3.0), x1(2.0, 4.0, 2.0), x2(8.0, -1.0, 0.5);
  Vector<3> r;
  Matrix<3, 3> J0, J1, J2;
  ConstantTwist<R3>{2.0, 3.0}(R3(x0), R3(x1), R3(x2), r, &J0, &J1, &J2);
  EXPECT_LE((r - (x2 - (x1 + 3.0 * (x1 - x0) / 2.0))).norm(), 1e-15);
  EXPECT_LE((J0 - 1.5 * Matrix<3, 3>::Identity()).norm(), 1e-15);
  EXPECT_LE((J1 + 2.5 * Matrix<3, 3>::Identity()).norm(), 1e-15);
  EXPECT_LE((J2 - Matrix<3, 3>::Identity()).norm(), 1e-15);
}

TEST(ConstantTwist, VanishesOnQuarterCircles) {
  // Unit circle about the origin, counter-clockwise: the heading is the polar angle plus 90°.
  const auto at = [](double x, double y, double heading) { return SE2(SO2(heading), Vector<2>(x, y)); };
  using std::numbers::pi;
  Vector<3> r;
  ConstantTwist<SE2>{1.0, 1.0}(at(1, 0, pi / 2), at(0, 1, pi), at(-1, 0, -pi / 2), r);
  EXPECT_LE(r.norm(), 5e-16);
  // A quarter circle in 1 s, then an eighth in 0.5 s.
  const double s = std::sqrt(0.5);
  ConstantTwist<SE2>{1.0, 0.5}(at(1, 0, pi / 2), at(0, 1, pi), at(-s, s, -3 * pi / 4), r);
  EXPECT_LE(r.norm(), 5e-16);
  // The vehicle stops instead: the error is the complete missing step.
  ConstantTwist<SE2>{1.0, 1.0}(at(1, 0, pi / 2), at(0, 1, pi), at(0, 1, pi), r);
  EXPECT_LE((r - Vector<3>(-pi / 2, 0.0, -pi / 2)).norm(), 5e-16);
}

}  // namespace
}  // namespace tandem::testing
