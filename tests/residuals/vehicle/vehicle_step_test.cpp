#include <gtest/gtest.h>

#include <tandem/residuals/vehicle/twist_kinematics.hpp>
#include <tandem/residuals/vehicle/vehicle_step.hpp>

#include "residuals/vehicle/some_vehicle.hpp"

namespace tandem::testing {
namespace {

VehicleState<3> some_state() {
  VehicleState<3> s;
  s.pose = SE3(SO3::Exp({0.3, -0.4, 1.1}), {4.0, -2.0, 1.0});
  s.twist << 1.2, -0.3, 0.2, 0.4, -0.5, 0.7;
  return s;
}

/// Returns the momentum of body and water about the world's origin: Ad(C)⁻ᵀ M ξ.
Vector<6> momentum_in_space(const VehicleBody& body, const VehicleState<3>& s) {
  return s.pose.Ad().transpose().partialPivLu().solve(Vector<6>(body.mass * s.twist));
}

VehicleState<3> run(const VehicleModel<3>& model, VehicleState<3> s, double seconds, int steps,
                    const Vector<3>& current = Vector<3>::Zero(), const Vector<3>& command = Vector<3>::Zero()) {
  const VehicleStep<3> step(model, seconds / steps);
  for (int k = 0; k < steps; ++k) s = step(s, command, current);
  return s;
}

TEST(VehicleStep, FreeVehicleConservesEnergy) {
  const auto vehicle = free_vehicle<3>();
  const double before = vehicle.kinetic_energy(some_state().twist);
  for (const int steps : {200, 1000, 4000}) {
    const VehicleState<3> after = run(vehicle, some_state(), 40.0, steps);
    EXPECT_NEAR(vehicle.kinetic_energy(after.twist), before, 1e-11 * before) << steps;
    EXPECT_GT((after.twist - some_state().twist).norm(), 0.1);  // the vehicle tumbles
  }
}

TEST(VehicleStep, FreeVehicleConservesMomentumToSecondOrder) {
  const auto vehicle = free_vehicle<3>();
  const Vector<6> before = momentum_in_space(vehicle, some_state());
  const auto error = [&](int steps) {
    return (momentum_in_space(vehicle, run(vehicle, some_state(), 5.0, steps)) - before).norm() / before.norm();
  };
  const double coarse = error(400), fine = error(800);
  EXPECT_LE(fine, 1e-3);
  EXPECT_NEAR(coarse / fine, 4.0, 0.2);
}

TEST(VehicleStep, DampingDissipatesEnergy) {
  auto vehicle = free_vehicle<3>();
  const auto damped = some_vehicle<3>();
  vehicle.linear = damped.linear;
  vehicle.quadratic = damped.quadratic;
  VehicleState<3> s = some_state();
  const VehicleStep<3> step(vehicle, 0.1);
  for (int k = 0; k < 100; ++k) {
    const double before = vehicle.kinetic_energy(s.twist);
    s = step(s, Vector<3>::Zero(), Vector<3>::Zero());
    EXPECT_LT(vehicle.kinetic_energy(s.twist), before);
  }
}

TEST(VehicleStep, MotionIsInvariantToCurrent) {
  // Relative to the water, the motion does not depend on the current.
  const auto vehicle = some_vehicle<3>();
  const Vector<3> current(0.4, -0.3, 0.1), command(0.5, -0.2, 0.3);
  VehicleState<3> carried = some_state();
  carried.twist.head<3>() += carried.pose.rotation().inverse().act(current);
  const auto error = [&](int steps) {
    const VehicleState<3> a = run(vehicle, some_state(), 2.0, steps, Vector<3>::Zero(), command);
    const VehicleState<3> b = run(vehicle, carried, 2.0, steps, current, command);
    return (b.pose.translation() - 2.0 * current - a.pose.translation()).norm() +
           (a.pose.rotation().inverse() * b.pose.rotation()).Log().norm();
  };
  const double coarse = error(200), fine = error(400);
  EXPECT_LE(fine, 1e-3);
  EXPECT_NEAR(coarse / fine, 4.0, 0.4);
}

TEST(VehicleStep, SatisfiesTheResiduals) {
  const auto vehicle = some_vehicle<3>();
  const double dt = 0.3;
  VehicleState<3> from = some_state();
  from.actuators << 0.3, -0.2, 0.5;
  const Vector<3> command(-0.4, 0.6, 0.1), current(0.2, 0.1, -0.1);
  const VehicleState<3> to = VehicleStep<3>(vehicle, dt)(from, command, current);
  Vector<6> r;
  VehicleDynamics<3>(vehicle, dt)(from.pose, Rn<6>(from.twist), Rn<6>(to.twist), R3(from.actuators), R3(command),
                                  R3(current), r);
  EXPECT_LE(r.norm(), 1e-12);
  TwistKinematics<SE3>{dt}(from.pose, Rn<6>(from.twist), to.pose, Rn<6>(to.twist), r);
  EXPECT_LE(r.norm(), 1e-13);
  Vector<3> lag;
  ActuatorLag<3>(vehicle.lag, dt)(R3(from.actuators), R3(command), R3(to.actuators), lag);
  EXPECT_LE(lag.norm(), 1e-15);
}

TEST(VehicleStep, OrConstantTwistContinuesWhereTheStepFails) {
  const auto vehicle = some_vehicle<3>();
  VehicleState<3> from = some_state();
  const Vector<3> none = Vector<3>::Zero();
  const VehicleStep<3> step(vehicle, 0.1);
  EXPECT_EQ(step.or_constant_twist(from, none, none).twist, step(from, none, none).twist);
  from.twist.tail<3>() *= 1e4;
  EXPECT_THROW(step(from, none, none), Error);
  const VehicleState<3> to = step.or_constant_twist(from, none, none);
  EXPECT_EQ(to.twist, from.twist);
  EXPECT_LE((to.pose.inverse() * from.pose * SE3::Exp(0.1 * from.twist)).Log().norm(), 1e-9);
}

TEST(VehicleModel, RejectsInvalidBodies) {
  const auto good = some_vehicle<3>();
  EXPECT_EQ(why_invalid(good), "");
  auto bad = good;
  bad.mass.row(2) *= -1.0;
  EXPECT_EQ(why_invalid(bad), "the mass matrix is not symmetric");
  bad = good;
  bad.mass(5, 5) = -1.0;
  EXPECT_EQ(why_invalid(bad), "the mass matrix is not positive definite");
  bad = good;
  bad.linear(3, 3) = -5.0;
  EXPECT_EQ(why_invalid(bad), "the linear damping matrix is not positive semidefinite, so it would drive the vehicle");
  bad = good;
  bad.linear.setZero();
  bad.quadratic.setZero();
  bad.lift.setZero();
  EXPECT_EQ(why_invalid(bad), "the damping matrix is not positive definite");
  bad.mass(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(why_invalid(bad), "a matrix of the vehicle has an entry that is not finite");
}

}  // namespace
}  // namespace tandem::testing
