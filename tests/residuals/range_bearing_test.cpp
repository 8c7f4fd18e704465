#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/log_range.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/range_bearing.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

using std::numbers::pi;

template <class Pair>
class RangeBearingTest : public ::testing::Test {
 protected:
  using C = typename Pair::first_type;
  using T = typename Pair::second_type;
  static constexpr int n = C::point_dim;

  const C B = C::Exp(tangent<C>(1.7, 0.5));
  const Vector<n> beacon = T::dof == n ? Vector<n>(Vector<n>::Zero()) : Vector<n>(Vector<n>::LinSpaced(-0.4, 0.9));
  const Direction<n> ahead{Vector<n>(Vector<n>::LinSpaced(0.8, -0.3))};
  const RangeBearing<C, T> residual{25.0, ahead, B, beacon};
};
using Pairs = ::testing::Types<std::pair<SE3, SE3>, std::pair<SE3, R3>, std::pair<SE2, SE2>, std::pair<SE2, R2>>;
TYPED_TEST_SUITE(RangeBearingTest, Pairs);

TYPED_TEST(RangeBearingTest, MeasurementAndResidualGiveTheTargetPosition) {
  using C = typename TypeParam::first_type;
  using T = typename TypeParam::second_type;
  constexpr int n = C::point_dim;
  for (const double angle : {0.0, 1e-6, 0.5, 3.0})
    for (const double size : {0.0, 1.0, 300.0}) {
      const C c = C::Exp(tangent<C>(angle, 20.0));
      const T t = T::Exp(tangent<T>(-angle, size));
      Vector<n> r;
      this->residual(c, t, r);
      // Reconstructs the measured vector from range and direction, using Exp on S² (or the angle) at `ahead`.
      const double range = 25.0 + r[0], off = r.template tail<n - 1>().norm();
      Vector<n> side;
      if constexpr (n == 3)
        side = this->ahead.axes() * r.template tail<2>() / off;
      else
        side = Vector<2>(-this->ahead.unit()[1], this->ahead.unit()[0]) * (r[1] / off);
      const Vector<n> p = range * (std::cos(off) * this->ahead.unit() + std::sin(off) * side);
      EXPECT_LE((c.act(this->B.act(p)) - t.act(this->beacon)).norm(), 5e-13) << angle << ", " << size;
    }
}

TYPED_TEST(RangeBearingTest, HasCorrectJacobians) {
  using C = typename TypeParam::first_type;
  using T = typename TypeParam::second_type;
  constexpr int n = C::point_dim;
  for (const auto& residual :
       {RangeBearing<C, T>{25.0, this->ahead}, RangeBearing<C, T>{25.0, this->ahead, this->B}, this->residual}) {
    for (const double angle : {0.0, 1e-9, 0.5, 3.0, pi - 1e-6})
      for (const double size : {0.0, 1.0, 300.0})
        expect_correct_jacobians(residual, C::Exp(tangent<C>(angle, 20.0)), T::Exp(tangent<T>(-angle, size)));
  }
  expect_correct_jacobians_at_random_states(this->residual, 5);
  // At the measured direction, near it, to the side and behind.
  const C c = C::Exp(tangent<C>(0.9, 20.0));
  for (const double off : {0.0, 1e-12, 1e-6, 0.03, 0.032, 1.5, 3.0, pi - 1e-3}) {
    Vector<n> side = Vector<n>::Unit(n - 1) - this->ahead.unit() * this->ahead.unit()[n - 1];
    const Vector<n> p = std::cos(off) * this->ahead.unit() + std::sin(off) * side.normalized();
    const RangeBearing<C, Rn<n>> seen{25.0, this->ahead, this->B};
    expect_correct_jacobians(seen, c, Rn<n>(c.act(this->B.act(12.0 * p))));
  }
}

TYPED_TEST(RangeBearingTest, StacksRangeAndBearing) {
  using C = typename TypeParam::first_type;
  using T = typename TypeParam::second_type;
  constexpr int n = C::point_dim;
  const Range<C, T> range{25.0, this->B, this->beacon};
  const Bearing<C, T> bearing{this->ahead, this->B, this->beacon};
  expect_correct_jacobians_at_random_states(range, 6);
  expect_correct_jacobians_at_random_states(LogRange<C, T>{25.0, this->B, this->beacon}, 6);
  expect_correct_jacobians_at_random_states(bearing, 7);
  const C c = C::Exp(tangent<C>(0.9, 20.0));
  const T t = T::Exp(tangent<T>(0.4, 7.0));
  Vector<n> both;
  Vector<1> r;
  Vector<n - 1> b;
  RowsBy<n, C> J_both;
  RowsBy<1, C> Jr;
  RowsBy<n - 1, C> Jb;
  this->residual(c, t, both, &J_both);
  range(c, t, r, &Jr);
  bearing(c, t, b, &Jb);
  EXPECT_EQ(both[0], r[0]);
  Vector<1> log_ratio;
  LogRange<C, T>{25.0, this->B, this->beacon}(c, t, log_ratio);
  EXPECT_NEAR(25.0 * std::exp(log_ratio[0]) - 25.0, r[0], 1e-12);
  EXPECT_EQ((both.template tail<n - 1>()), b);
  EXPECT_LE((J_both.row(0) - Jr).norm(), 1e-15);
  EXPECT_LE((J_both.template bottomRows<n - 1>() - Jb).norm(), 1e-15);
}

TYPED_TEST(RangeBearingTest, ThrowsAtTheSensor) {
  using C = typename TypeParam::first_type;
  using T = typename TypeParam::second_type;
  constexpr int n = C::point_dim;
  const auto message = [](const auto& residual) {
    Vector<std::decay_t<decltype(residual)>::dim> r;
    try {
      residual(C(), T(), r);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(message(RangeBearing<C, T>{25.0, this->ahead}),
              HasSubstr("range-bearing: undefined if the target is at"));
  EXPECT_THAT(message(Range<C, T>{25.0}), HasSubstr("range: undefined"));
  EXPECT_THAT(message(Bearing<C, T>{this->ahead}), HasSubstr("bearing: undefined"));
  Vector<n> r;
  const Vector<n> near = 2e-9 * this->ahead.unit();
  RangeBearing<C, Rn<n>>{0.0, this->ahead}(C(), Rn<n>(near), r);
  EXPECT_NEAR(r[0], 2e-9, 1e-24);
}

TEST(RangeBearing, MatchesHandCalculation) {
  // The sensor at (1, 2, 3) is turned left by 90°: a target at (-2, 6, 3) is 4 m ahead and 3 m to the left.
  const SO3 left = SO3::Exp({0.0, 0.0, pi / 2});
  const SE3 chaser(left, Vector<3>(1.0, 2.0, 3.0));
  const R3 target(Vector<3>(-2.0, 6.0, 3.0));
  Vector<3> r;
  RangeBearing<SE3, R3>{4.5, Direction<3>(0.0, 0.0)}(chaser, target, r);
  EXPECT_LE((r - Vector<3>(0.5, std::atan2(3.0, 4.0), 0.0)).norm(), 2e-15);
  // Measured straight up at azimuth 0: e1 points along +y, e2 along −x.
  RangeBearing<SE3, R3>{5.0, Direction<3>(0.0, pi / 2)}(chaser, target, r);
  EXPECT_LE((r - pi / 2 * Vector<3>(0.0, 0.6, -0.8)).norm(), 2e-15);
  // Small errors are the azimuth error times the cosine of the elevation, and the elevation error.
  RangeBearing<SE3, R3>{5.0, Direction<3>(0.3, 1.0)}(SE3(), R3(Vector<3>(5.0 * Direction<3>(0.3002, 0.9999).unit())),
                                                     r);
  EXPECT_NEAR(r[1], 2e-4 * std::cos(1.0), 3e-8);
  EXPECT_NEAR(r[2], -1e-4, 3e-8);
  // In the plane: the sensor is 1 m astern and looks backward; the target is 1 m ahead of it.
  Vector<2> planar;
  const SE2 astern(SO2(pi), Vector<2>(-1.0, 0.0));
  RangeBearing<SE2, R2>{1.5, 0.1, astern}(SE2(), R2(Vector<2>(-2.0, 0.0)), planar);
  EXPECT_LE((planar - Vector<2>(-0.5, -0.1)).norm(), 1e-15);
}

TEST(Bearing, ThrowsOppositeToTheMeasuredDirection) {
  const Bearing<SE3, R3> residual{Direction<3>(0.4, 0.2)};
  Vector<2> r;
  try {
    residual(SE3(), R3(Vector<3>(-3.0 * residual.bearing.unit())), r);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("opposite to the measured direction"));
  }
}

}  // namespace
}  // namespace tandem::testing
