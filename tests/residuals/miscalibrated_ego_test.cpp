#include <gtest/gtest.h>

#include <tandem/residuals/depth.hpp>
#include <tandem/residuals/dvl_velocity.hpp>
#include <tandem/residuals/gps.hpp>
#include <tandem/residuals/heading.hpp>
#include <tandem/residuals/miscalibrated_ego.hpp>

#include "residuals/autodiff.hpp"
#include "residuals/imu_cases.hpp"

namespace tandem::testing {
namespace {

const Vector<3> turning(0.1, -0.3, 0.4), pushing(0.5, 0.2, 9.9);
const SO3 mount = SO3::Exp({0.2, -0.1, 0.7});

/// Simulates the measurement of a sensor with these errors on a rotating and accelerating body.
TEST(MiscalibratedEgo, VanishesForTheTrueCalibrationErrors) {
  const SE3 x = SE3::Exp(tangent<SE3>(0.8, 3.0));
  const Vector<3> v(1.2, -0.4, 0.2), bias(0.1, -0.2, 0.3);
  const SO3 turn = SO3::Exp({0.1, -0.2, 0.3});
  const Earth earth;
  const double delay = 0.2, scale = -0.07;
  const Vector<3> fall = x.rotation().act(pushing) + earth.gravity;
  const SO3 then = x.rotation() * SO3::Exp(-delay * turning);
  const Vector<3> body = then.inverse().act(v - delay * fall);
  const Vector<3> z = (1 + scale) * (mount * turn * mount.inverse()).inverse().act(body) + bias;
  Vector<3> r;
  MiscalibratedEgo<DvlVelocity>{{z}, mount, {}, earth, turning, pushing}(
      x, R3(v), Rn<6>(), R3(bias), Rn<1>(Vector<1>(scale)), turn, Rn<1>(Vector<1>(delay)), r);
  EXPECT_LT(r.norm(), 1e-13);

  const Vector<3> p = x.translation() - delay * v + 0.5 * delay * delay * fall, lever(0.3, 0.1, -0.2);
  const double height = p.z() + then.act(lever).z();
  Vector<1> h;
  MiscalibratedEgo<Depth>{{(1 + scale) * height + 0.4, lever}, {}, {}, earth, turning, pushing}(
      x, R3(v), Rn<6>(), Rn<1>(Vector<1>(0.4)), Rn<1>(Vector<1>(scale)), SO3(), Rn<1>(Vector<1>(delay)), h);
  EXPECT_NEAR(h[0], 0, 1e-13);
}

TEST(MiscalibratedEgo, EqualsPropagatedWithoutErrors) {
  const ImuDelta delta = some_delta();
  const SE3 x = SE3::Exp(tangent<SE3>(0.8, 3.0));
  const R3 v(Vector<3>(1.2, -0.4, 0.2));
  const DvlVelocity plain{Vector<3>(1, 0.1, 0)};
  Vector<3> r, with;
  Propagated<DvlVelocity>{plain, delta, Earth{}}(x, v, Rn<6>(), r);
  MiscalibratedEgo<DvlVelocity>{plain, mount, delta, Earth{}, turning, pushing}(x, v, Rn<6>(), R3(), Rn<1>(), SO3(),
                                                                                Rn<1>(), with);
  EXPECT_LT((r - with).norm(), 1e-13);
}

TEST(MiscalibratedEgo, HasCorrectJacobians) {
  const ImuDelta delta = some_delta();
  const Earth earth{Vector<3>(0, 0, -9.81), Vector<3>(1e-5, 2e-5, 5e-5)};
  expect_correct_jacobians_at_random_states(
      MiscalibratedEgo<DvlVelocity>{{Vector<3>(1, 0.2, -0.1)}, mount, delta, earth, turning, pushing}, 5);
  expect_correct_jacobians_at_random_states(
      MiscalibratedEgo<Depth>{{-12.0, Vector<3>(0.3, 0.1, -0.2)}, {}, delta, earth, turning, pushing}, 6);
  expect_correct_jacobians_at_random_states(
      MiscalibratedEgo<Gps>{{Vector<3>(3, 2, 1), Vector<3>(0.3, 0.1, -0.2)}, {}, delta, earth, turning, pushing}, 7);
  expect_correct_jacobians_at_random_states(
      MiscalibratedEgo<Heading>{{SO3::Exp({0.1, 0.2, 1.0}), mount}, mount, delta, earth, turning, pushing}, 8);
}

/// Residuals near zero and near π.
TEST(MiscalibratedEgo, HasCorrectJacobiansAtTypicalErrors) {
  const SE3 x = SE3::Exp(tangent<SE3>(0.8, 3.0));
  const R3 v(Vector<3>(1.2, -0.4, 0.2));
  for (const double size : {0.0, 1e-9, 1e-3, 0.1})
    for (const Vector<3>& e : residual_sizes<SO3>())
      expect_correct_jacobians(
          MiscalibratedEgo<Heading>{{x.rotation() * SO3::Exp(-e) * mount, mount}, mount, {}, {}, turning, pushing}, x,
          v, Rn<6>(), R3(Vector<3>(size, size, -size)), Rn<1>(Vector<1>(size)), SO3::Exp({size, -size, size}),
          Rn<1>(Vector<1>(2 * size)));
}

}  // namespace
}  // namespace tandem::testing
