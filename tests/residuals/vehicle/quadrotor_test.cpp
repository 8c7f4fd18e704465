#include <gtest/gtest.h>

#include <tandem/lie/se3.hpp>
#include <tandem/residuals/vehicle/quadrotor.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

const Quadrotor kQuadrotor{1.0, {5e-3, 5e-3, 10e-3}, 0.2, 0.05};

TEST(Quadrotor, HasCorrectJacobians) {
  expect_correct_jacobians_at_random_states(EulerKinematics<SO3>{0.04}, 1);
  expect_correct_jacobians_at_random_states(EulerKinematics<R3>{0.04}, 2);
  expect_correct_jacobians_at_random_states(QuadrotorRate{kQuadrotor, 0.04}, 3);
  expect_correct_jacobians_at_random_states(QuadrotorVelocity{kQuadrotor, 0.04}, 4);
}

TEST(Quadrotor, HoverAndRotorTorquesHaveCorrectSigns) {
  const Rn<4> hover(Vector<4>(Vector<4>::Constant(kQuadrotor.hover())));
  Vector<3> r;
  QuadrotorVelocity{kQuadrotor, 0.04}(R3(), SO3(), hover, R3(), r);
  EXPECT_LE(r.norm(), 1e-15);
  QuadrotorRate{kQuadrotor, 0.04}(R3(), hover, R3(), r);
  EXPECT_LE(r.norm(), 1e-15);
  // Thrust of the left rotor (+y) causes a roll to the right (about +x): 0.2 m · 1 N / 5 g m².
  QuadrotorRate{kQuadrotor, 0.04}(R3(), Rn<4>(Vector<4>(0.0, 1.0, 0.0, 0.0)), R3(), r);
  EXPECT_NEAR(-r[0], 0.04 * 0.2 / 5e-3, 1e-12);
  EXPECT_NEAR(-r[2], -0.04 * 0.05 / 10e-3, 1e-12);
}

TEST(Quadrotor, ConservesAngularMomentumWithoutTorque) {
  // To first order in dt: R1 J ω1 = R0 J ω0.
  const Vector<3> w(5.0, -4.0, 3.0), inertia(4e-3, 5e-3, 10e-3);
  Quadrotor model = kQuadrotor;
  model.inertia = inertia;
  const double dt = 1e-5;
  Vector<3> r;
  QuadrotorRate{model, dt}(R3(w), Rn<4>(), R3(w), r);
  const Vector<3> next = w - r;
  const Vector<3> before = inertia.cwiseProduct(w), after = SO3::Exp(dt * w).act(Vector<3>(inertia.cwiseProduct(next)));
  EXPECT_LE((after - before).norm(), 1e-9);
  EXPECT_GT((next - w).norm(), 1e-5);
}

}  // namespace
}  // namespace tandem::testing
