#include <gtest/gtest.h>

#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/miscalibrated.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

const SE3 mounted(SO3::Exp({0.3, -0.2, 0.9}), {0.5, -0.2, 0.3});
const Vector<3> beacon(0.4, 0.1, -0.3);

/// Simulates the measurement of a sensor with these errors.
TEST(Miscalibrated, VanishesForTheTrueCalibrationErrors) {
  const SE3 c0 = SE3::Exp(tangent<SE3>(0.4, 2.0)), t0(SO3::Exp({0.1, 0.2, 2.0}), {8, -3, 1});
  const Vector<6> chaser_twist = tangent<SE3>(0.1, 0.8), target_twist = tangent<SE3>(-0.2, 0.5);
  const auto chaser = [&](double t) { return c0 * SE3::Exp(t * chaser_twist); };
  const auto target = [&](double t) { return t0 * SE3::Exp(t * target_twist); };
  const Vector<3> bias(0.1, -0.2, 0.3);
  const SO3 turn = SO3::Exp({0.1, -0.2, 0.3});
  const double now = 3.0, delay = 0.4, scale = 0.05;
  const SE3 sensor = chaser(now - delay) * mounted * SE3(turn, Vector<3>::Zero());
  const Vector<3> z = (1 + scale) * sensor.inverse().act(target(now - delay).act(beacon)) + bias;
  for (const double time_since_states : {0.0, 0.3})
    for (const NeighbourGaps& gaps : {NeighbourGaps{1.0, 0.7}, NeighbourGaps{1.0, 0}, NeighbourGaps{0, 0.7}}) {
      const double at = now - time_since_states;
      Vector<3> r;
      Miscalibrated<UsblPosition<>>{{z, mounted, beacon}, mounted, beacon, gaps, time_since_states}(
          chaser(at), chaser(at - gaps.before), chaser(at + gaps.after), target(at), target(at - gaps.before),
          target(at + gaps.after), R3(bias), Rn<1>(Vector<1>(scale)), turn, Rn<1>(Vector<1>(delay)), r);
      EXPECT_LT(r.norm(), 1e-13);
    }
}

TEST(Miscalibrated, EqualsWrappedResidualWithoutErrors) {
  const UsblPosition<> plain{Vector<3>(1, 2, 3), mounted, beacon};
  const SE3 c = SE3::Exp(tangent<SE3>(0.9, 2.0)), t = SE3::Exp(tangent<SE3>(2.6, 9.0));
  Vector<3> r, with;
  Matrix<3, 6> Jc, Jt, with_Jc, with_Jt, before, after;
  plain(c, t, r, &Jc, &Jt);
  Miscalibrated<UsblPosition<>>{plain, mounted, beacon}(c, SE3(), SE3(), t, SE3(), SE3(), R3(), Rn<1>(), SO3(), Rn<1>(),
                                                        with, &with_Jc, &before, &after, &with_Jt);
  EXPECT_LT((r - with).norm(), 1e-13);
  EXPECT_LT((Jc - with_Jc).norm() + (Jt - with_Jt).norm(), 1e-12);
  EXPECT_EQ(before.norm() + after.norm(), 0);
}

TEST(Miscalibrated, ScaleErrorMovesTargetAlongTheLineOfSight) {
  const RelativePose<> plain{SE3::Exp(tangent<SE3>(0.3, 3.0)), mounted};
  Vector<6> r;
  Matrix<6, 1> by_scale;
  const SE3 c, t = mounted * plain.z;
  Miscalibrated<RelativePose<>>{plain, mounted}(c, c, c, t, t, t, Rn<6>(), Rn<1>(), SO3(), Rn<1>(), r, nullptr, nullptr,
                                                nullptr, nullptr, nullptr, nullptr, nullptr, &by_scale);
  EXPECT_LT(r.norm(), 1e-13);
  EXPECT_LT(by_scale.tail<3>().norm(), 1e-13);
  EXPECT_NEAR(by_scale.norm(), plain.z.translation().norm(), 1e-12);
}

/// Random delays reach 100 s. The keyframes are equally far apart, so that the motion is not extrapolated over many
/// rotations.
TEST(Miscalibrated, HasCorrectJacobians) {
  const Vector<3> z(1.0, 2.3, 3.0);
  expect_correct_jacobians_at_random_states(
      Miscalibrated<UsblPosition<>>{{z, mounted, beacon}, mounted, beacon, {120, 90}}, 3);
  expect_correct_jacobians_at_random_states(
      Miscalibrated<UsblPosition<SE3, R3>>{{z, mounted}, mounted, Vector<3>::Zero(), {0, 80}}, 4);
  expect_correct_jacobians_at_random_states(
      Miscalibrated<RelativePose<>>{{SE3::Exp(0.3 * Vector<6>::Ones()), mounted}, mounted, Vector<3>::Zero(), {0.5, 0}},
      5);
}

TEST(Miscalibrated, HasCorrectJacobiansInThePlane) {
  const SE2 mount(SO2(0.4), {0.3, 0.1});
  expect_correct_jacobians_at_random_states(
      Miscalibrated<RangeBearing<SE2>>{{5.0, Direction<2>(0.1), mount}, mount, Vector<2>::Zero(), {100, 200}}, 6);
  expect_correct_jacobians_at_random_states(
      Miscalibrated<Bearing<SE2, R2>>{{Direction<2>(0.1), mount}, mount, Vector<2>::Zero(), {200, 100}}, 7);
}

/// Typical errors: some per cent, degrees and tenths of a second; residuals near zero and near π.
TEST(Miscalibrated, HasCorrectJacobiansAtTypicalErrors) {
  const SE3 c = SE3::Exp(tangent<SE3>(0.9, 2.0)), c_before = c * SE3::Exp(tangent<SE3>(-0.1, -0.5)),
            c_after = c * SE3::Exp(tangent<SE3>(0.2, 0.6));
  const SE3 t = SE3::Exp(tangent<SE3>(2.0, 9.0)), t_before = t * SE3::Exp(tangent<SE3>(0.2, -0.8)),
            t_after = t * SE3::Exp(tangent<SE3>(-0.2, 0.9));
  for (const double size : {0.0, 1e-9, 1e-3, 0.1})
    for (const Vector<6>& e : residual_sizes<SE3>()) {
      const RelativePose<> pose{(c * mounted).inverse() * t * SE3::Exp(-e), mounted};
      expect_correct_jacobians(Miscalibrated<RelativePose<>>{pose, mounted, Vector<3>::Zero(), {1.0, 1.1}}, c, c_before,
                               c_after, t, t_before, t_after, Rn<6>(Vector<6>(size * Vector<6>::Ones())),
                               Rn<1>(Vector<1>(size)), SO3::Exp({size, -size, size}), Rn<1>(Vector<1>(2 * size)));
    }
}

}  // namespace
}  // namespace tandem::testing
