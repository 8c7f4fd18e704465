#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class Pair>
class UsblPositionTest : public ::testing::Test {};
using Pairs = ::testing::Types<std::pair<SE3, SE3>, std::pair<SE3, R3>, std::pair<SE2, SE2>, std::pair<SE2, R2>>;
TYPED_TEST_SUITE(UsblPositionTest, Pairs);

TYPED_TEST(UsblPositionTest, IsPositionInTheSensorFrame) {
  using C = typename TypeParam::first_type;
  using T = typename TypeParam::second_type;
  constexpr int n = C::point_dim;
  const Vector<n> z = Vector<n>::LinSpaced(3.0, -7.0);
  const Vector<n> beacon = T::dof == n ? Vector<n>(Vector<n>::Zero()) : Vector<n>(Vector<n>::LinSpaced(-0.4, 0.9));
  for (const double angle : {0.0, 1e-6, 0.5, 3.0})
    for (const double size : {0.0, 1.0, 300.0}) {
      const C c = C::Exp(tangent<C>(angle, 20.0)), B = C::Exp(tangent<C>(1.7, 0.5));
      const T t = T::Exp(tangent<T>(-angle, size));
      Vector<n> r;
      UsblPosition<C, T>{z, B, beacon}(c, t, r);
      // C B [r + z; 1] = T [beacon; 1]
      Vector<n + 1, long double> seen, marker;
      seen << (r + z).template cast<long double>(), 1.0L;
      marker << beacon.template cast<long double>(), 1.0L;
      EXPECT_LE(difference(plain(t) * marker, plain(c) * plain(B) * seen), 1e-14) << angle << ", " << size;
    }
}

TYPED_TEST(UsblPositionTest, HasCorrectJacobians) {
  using C = typename TypeParam::first_type;
  using T = typename TypeParam::second_type;
  constexpr int n = C::point_dim;
  const Vector<n> z = Vector<n>::LinSpaced(3.0, -7.0), beacon = Vector<n>::LinSpaced(-0.4, 0.9);
  const C B = C::Exp(tangent<C>(1.7, 0.5));
  for (const UsblPosition<C, T>& residual :
       {UsblPosition<C, T>{z}, UsblPosition<C, T>{z, B}, UsblPosition<C, T>{z, B, beacon}}) {
    for (const double angle : {0.0, 1e-9, 0.5, 3.0, std::numbers::pi - 1e-6})
      for (const double size : {0.0, 1.0, 300.0})
        expect_correct_jacobians(residual, C::Exp(tangent<C>(angle, 20.0)), T::Exp(tangent<T>(-angle, size)));
    expect_correct_jacobians_at_random_states(residual, 5);
  }
}

TEST(UsblPosition, MatchesHandCalculation) {
  // The chaser at (1, 2, 3) is turned left by 90°: a target at (1, 6, 3) is 4 m ahead. Its beacon, 1 m to its left, is
  // in the direction −x.
  const SO3 left = SO3::Exp({0.0, 0.0, std::numbers::pi / 2});
  const SE3 chaser(left, Vector<3>(1.0, 2.0, 3.0)), target(left, Vector<3>(1.0, 6.0, 3.0));
  Vector<3> r;
  UsblPosition<>{Vector<3>(4.0, 0.0, 0.0)}(chaser, target, r);
  EXPECT_LE(r.norm(), 2e-15);
  UsblPosition<SE3, R3>{Vector<3>(4.0, 0.0, 0.0)}(chaser, R3(Vector<3>(1.0, 6.0, 3.0)), r);
  EXPECT_LE(r.norm(), 2e-15);
  UsblPosition<>{Vector<3>::Zero(), SE3(), Vector<3>(0.0, 1.0, 0.0)}(chaser, target, r);
  EXPECT_LE((r - Vector<3>(4.0, 1.0, 0.0)).norm(), 2e-15);
  // The transducer is mounted 0.5 m below the chaser and looks backward.
  const SE3 transducer(SO3::Exp({0.0, 0.0, std::numbers::pi}), Vector<3>(0.0, 0.0, -0.5));
  UsblPosition<>{Vector<3>::Zero(), transducer}(chaser, target, r);
  EXPECT_LE((r - Vector<3>(-4.0, 0.0, 0.5)).norm(), 2e-15);
}

TEST(UsblPosition, IsIndependentOfTargetOrientationWithoutLeverArm) {
  Matrix<3, 6> J;
  Vector<3> r;
  UsblPosition<>{Vector<3>::Zero()}(SE3::Exp(tangent<SE3>(0.3, 1.0)), SE3::Exp(tangent<SE3>(1.0, 9.0)), r, nullptr, &J);
  EXPECT_EQ((J.rightCols<3>().cwiseAbs().maxCoeff()), 0.0);
}

}  // namespace
}  // namespace tandem::testing
