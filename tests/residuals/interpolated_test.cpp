#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/interpolated.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

const SE3 kSensor = SE3::Exp(tangent<SE3>(1.7, 0.5));

TEST(Interpolated, EqualsTheResidualAtTheKeyframes) {
  std::mt19937_64 random(3);
  const UsblPosition<SE3, R3> residual{Vector<3>(1.0, -2.0, 3.0), kSensor};
  for (int i = 0; i < 8; ++i) {
    const auto [c0, c1, t0, t1] = random_states<std::tuple<SE3, SE3, R3, R3>>(random, StateDistance(i % 4));
    Vector<3> r, expected;
    Interpolated{residual, 0.0}(c0, c1, t0, t1, r);
    residual(c0, t0, expected);
    EXPECT_LE(difference(expected, r), 1e-14);
    Interpolated{residual, 1.0}(c0, c1, t0, t1, r);
    residual(c1, t1, expected);
    EXPECT_LE(difference(expected, r), 1e-14);
  }
}

TEST(Interpolated, EqualsTheResidualAlongConstantTwist) {
  const Vector<6> chaser = tangent<SE3>(0.6, 2.0), target = tangent<SE3>(-0.9, 1.5);  // motion in the interval
  const SE3 c0 = SE3::Exp(tangent<SE3>(1.0, 20.0)), t0 = SE3::Exp(tangent<SE3>(0.4, 9.0));
  const RelativePose<> residual{SE3(), kSensor};
  for (const double s : {-0.2, 0.3, 0.5, 1.1}) {
    Vector<6> r, expected;
    Interpolated{residual, s}(c0, c0 * SE3::Exp(chaser), t0, t0 * SE3::Exp(target), r);
    residual(c0 * SE3::Exp(s * chaser), t0 * SE3::Exp(s * target), expected);
    EXPECT_LE(difference(expected, r), 1e-13) << s;
  }
}

TEST(Interpolated, MatchesHandCalculation) {
  // The chaser moves from x = 0 to 4 m, the target from (10, 0) to (10, 8). After a quarter of the interval the sensor,
  // at (1, 0), sees it at (9, 2).
  const SE2 c1(SO2(), Vector<2>(4.0, 0.0));
  const R2 t0(Vector<2>(10.0, 0.0)), t1(Vector<2>(10.0, 8.0));
  Vector<2> r;
  Interpolated{UsblPosition<SE2, R2>{Vector<2>(8.5, 2.0)}, 0.25}(SE2(), c1, t0, t1, r);
  EXPECT_LE((r - Vector<2>(0.5, 0.0)).norm(), 2e-15);
}

TEST(Interpolated, HasCorrectJacobians) {
  const RelativePose<> pose{SE3::Exp(tangent<SE3>(0.8, 4.0)), kSensor};
  const UsblPosition<SE3, R3> usbl{Vector<3>(1.0, -2.0, 3.0), kSensor};
  const SE2 planar_sensor = SE2::Exp(tangent<SE2>(1.7, 0.5));
  const RangeBearing<SE2, R2> planar{25.0, 0.4, planar_sensor};
  for (const double s : {0.0, 0.3, 1.0, 1.2}) {
    expect_correct_jacobians_at_random_states(Interpolated{pose, s}, 1, 16);
    expect_correct_jacobians_at_random_states(Interpolated{usbl, s}, 2, 16);
    expect_correct_jacobians_at_random_states(Interpolated{planar, s}, 3, 16);
  }
  for (const auto& e : residual_sizes<SE3>()) {
    const SE3 c0 = SE3::Exp(tangent<SE3>(0.3, 20.0)), t0 = c0 * SE3::Exp(tangent<SE3>(0.9, 7.0));
    expect_correct_jacobians(Interpolated{pose, 0.3}, c0, SE3(c0 * SE3::Exp(e)), t0, SE3(t0 * SE3::Exp(-e)));
    expect_correct_jacobians(Interpolated{usbl, 0.3}, c0, SE3(c0 * SE3::Exp(e)), R3(t0.translation()), R3());
  }
}

/// A user-defined residual for double only.
struct Gap {
  static constexpr std::string_view name = "gap";
  static constexpr int dim = 3;
  using States = std::tuple<R3, R3>;
  void operator()(const R3& x, const R3& y, Vector<3>& r, Matrix<3, 3>* Jx = nullptr,
                  Matrix<3, 3>* Jy = nullptr) const {
    r = y.vector() - x.vector();
    if (Jx) *Jx = -Matrix<3, 3>::Identity();
    if (Jy) Jy->setIdentity();
  }
};
TEST(Interpolated, AcceptsUserDefinedResidual) {
  static_assert(Residual<Interpolated<Gap>>);
  EXPECT_EQ(Interpolated<Gap>::name, "gap");
  expect_correct(check_jacobians_at_random(Interpolated{Gap{}, 0.3}, 1, 8));
}

}  // namespace
}  // namespace tandem::testing
