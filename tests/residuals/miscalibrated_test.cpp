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

/// What a sensor reads that has these errors: written out, as a simulator would.
TEST(Miscalibrated, is_zero_where_the_errors_are_those_of_the_sensor) {
  const SE3 c0 = SE3::Exp(tangent<SE3>(0.4, 2.0)), t0(SO3::Exp({0.1, 0.2, 2.0}), {8, -3, 1});
  const Vector<6> chaser_twist = tangent<SE3>(0.1, 0.8), target_twist = tangent<SE3>(-0.2, 0.5);
  const auto chaser = [&](double t) { return c0 * SE3::Exp(t * chaser_twist); };
  const auto target = [&](double t) { return t0 * SE3::Exp(t * target_twist); };
  const Vector<3> bias(0.1, -0.2, 0.3);
  const SO3 turn = SO3::Exp({0.1, -0.2, 0.3});
  const double now = 3.0, delay = 0.4, scale = 0.05;
  const SE3 sensor = chaser(now - delay) * mounted * SE3(turn, Vector<3>::Zero());
  const Vector<3> z = (1 + scale) * sensor.inverse().act(target(now - delay).act(beacon)) + bias;
  for (const double later : {0.0, 0.3})  // than the states
    for (const Neighbours& apart : {Neighbours{1.0, 0.7}, Neighbours{1.0, 0}, Neighbours{0, 0.7}}) {
      const double at = now - later;
      Vector<3> r;
      Miscalibrated<UsblPosition<>>{{z, mounted, beacon}, mounted, beacon, apart, later}(
          chaser(at), chaser(at - apart.before), chaser(at + apart.after), target(at), target(at - apart.before),
          target(at + apart.after), R3(bias), Rn<1>(Vector<1>(scale)), turn, Rn<1>(Vector<1>(delay)), r);
      EXPECT_LT(r.norm(), 1e-13);
    }
}

TEST(Miscalibrated, without_errors_is_what_it_wraps) {
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

TEST(Miscalibrated, moves_a_pose_along_the_line_of_sight_alone) {
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

/// Delays at random are of up to 100 s: keyframes are as far apart, so that motion is not extrapolated over many turns.
TEST(Miscalibrated, has_the_right_jacobians) {
  const Vector<3> z(1.0, 2.3, 3.0);
  expect_right_jacobians_at_random(Miscalibrated<UsblPosition<>>{{z, mounted, beacon}, mounted, beacon, {120, 90}}, 3);
  expect_right_jacobians_at_random(
      Miscalibrated<UsblPosition<SE3, R3>>{{z, mounted}, mounted, Vector<3>::Zero(), {0, 80}}, 4);
  expect_right_jacobians_at_random(
      Miscalibrated<RelativePose<>>{{SE3::Exp(0.3 * Vector<6>::Ones()), mounted}, mounted, Vector<3>::Zero(), {0.5, 0}},
      5);
}

TEST(Miscalibrated, has_the_right_jacobians_in_the_plane) {
  const SE2 mount(SO2(0.4), {0.3, 0.1});
  expect_right_jacobians_at_random(
      Miscalibrated<RangeBearing<SE2>>{{5.0, Direction<2>(0.1), mount}, mount, Vector<2>::Zero(), {100, 200}}, 6);
  expect_right_jacobians_at_random(
      Miscalibrated<Bearing<SE2, R2>>{{Direction<2>(0.1), mount}, mount, Vector<2>::Zero(), {200, 100}}, 7);
}

/// Errors as they are: of per cents, degrees and tenths of a second, residuals near nothing and near half a turn.
TEST(Miscalibrated, has_the_right_jacobians_at_plausible_errors) {
  const SE3 c = SE3::Exp(tangent<SE3>(0.9, 2.0)), c_before = c * SE3::Exp(tangent<SE3>(-0.1, -0.5)),
            c_after = c * SE3::Exp(tangent<SE3>(0.2, 0.6));
  const SE3 t = SE3::Exp(tangent<SE3>(2.0, 9.0)), t_before = t * SE3::Exp(tangent<SE3>(0.2, -0.8)),
            t_after = t * SE3::Exp(tangent<SE3>(-0.2, 0.9));
  for (const double size : {0.0, 1e-9, 1e-3, 0.1})
    for (const Vector<6>& e : residual_sizes<SE3>()) {
      const RelativePose<> pose{(c * mounted).inverse() * t * SE3::Exp(-e), mounted};
      expect_right_jacobians(Miscalibrated<RelativePose<>>{pose, mounted, Vector<3>::Zero(), {1.0, 1.1}}, c, c_before,
                             c_after, t, t_before, t_after, Rn<6>(Vector<6>(size * Vector<6>::Ones())),
                             Rn<1>(Vector<1>(size)), SO3::Exp({size, -size, size}), Rn<1>(Vector<1>(2 * size)));
    }
}

}  // namespace
}  // namespace tandem::testing
