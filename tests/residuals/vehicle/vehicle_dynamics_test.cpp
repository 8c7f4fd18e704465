#include <gtest/gtest.h>

#include <tandem/residuals/vehicle/actuator_lag.hpp>
#include <tandem/residuals/vehicle/vehicle_dynamics.hpp>

#include "allocation_count.hpp"
#include "residuals/curvature_autodiff.hpp"
#include "residuals/vehicle/some_vehicle.hpp"

namespace tandem::testing {
namespace {

Vector<6> twist_of(double scale) {
  Vector<6> v;
  v << 1.5, -0.3, 0.2, 0.1, -0.4, 0.6;
  return scale * v;
}

template <int N>
void expect_correct_at(const VehicleDynamics<N>& dynamics, const SE3& pose, double speed) {
  expect_correct_jacobians(dynamics, pose, Rn<6>(twist_of(speed)), Rn<6>(twist_of(-0.4 * speed)),
                           Rn<N>(Vector<N>::LinSpaced(-0.5, 0.7)), Rn<N>(Vector<N>::LinSpaced(0.9, -0.2)),
                           R3(Vector<3>(0.3, -0.2, 0.05)));
}

TEST(VehicleDynamics, HasCorrectJacobians) {
  const auto vehicle = some_vehicle<3>();
  const VehicleDynamics<3> dynamics(vehicle, 0.8);
  for (const auto& d : residual_sizes<SE3>())
    for (const double speed : {0.0, 1e-6, 1e-3, 0.1, 1.0, 3.0}) expect_correct_at(dynamics, SE3::Exp(d), speed);
}

TEST(VehicleDynamics, HasCorrectJacobiansAtRandomStates) {
  const auto vehicle = some_vehicle<3>();
  expect_correct_jacobians_at_random_states(VehicleDynamics<3>(vehicle, 0.1), 1);
}

template <int N>
void expect_correct_curvature_of_vehicle() {
  const auto vehicle = some_vehicle<N>();
  const VehicleDynamics<N> dynamics(vehicle, 0.8);
  const Vector<6> w = twist_of(1.0).reverse();
  for (const auto& d : residual_sizes<SE3>())
    for (const double speed : {0.0, 1e-6, 1e-3, 0.1, 1.0, 3.0})
      expect_correct_curvature(dynamics, w, SE3::Exp(d), Rn<6>(twist_of(speed)), Rn<6>(twist_of(-0.4 * speed)),
                               Rn<N>(Vector<N>::LinSpaced(-0.5, 0.7)), Rn<N>(Vector<N>::LinSpaced(0.9, -0.2)),
                               R3(Vector<3>(0.3, -0.2, 0.05)));
}

TEST(VehicleDynamics, HasCorrectCurvature) {
  expect_correct_curvature_of_vehicle<3>();
  expect_correct_curvature_of_vehicle<8>();
}

TEST(VehicleDynamics, DoesNotAllocate) {
  const auto vehicle = some_vehicle<3>();
  const VehicleDynamics<3> dynamics(vehicle, 0.8);
  Vector<6> r;
  Matrix<6, 6> Jx, J0, J1;
  Matrix<6, 3> Ja, Ju, Jc;
  const long before = allocations;
  dynamics(SE3(), Rn<6>(twist_of(1.0)), Rn<6>(twist_of(0.9)), R3(), R3(), R3(), r, &Jx, &J0, &J1, &Ja, &Ju, &Jc);
  EXPECT_EQ(allocations, before);
  EXPECT_GT(r.norm(), 0.0);
}

TEST(VehicleDynamics, ObeysNewtonsLawAtRest) {
  // At rest and upright, actuators accelerate the vehicle by M⁻¹ τ, and weight minus buoyancy pulls it down.
  auto vehicle = some_vehicle<3>();
  vehicle.centre_of_mass.setZero();
  vehicle.centre_of_buoyancy.setZero();
  const double dt = 1e-6;
  Vector<6> r;
  const Vector<3> u(0.4, -0.2, 0.6);
  VehicleDynamics<3>(vehicle, dt)(SE3(), Rn<6>(), Rn<6>(), R3(u), R3(u), R3(), r);
  Vector<6> wrench = vehicle.thrust * u;
  wrench[2] += vehicle.buoyancy - vehicle.weight;
  EXPECT_LE((r / dt + vehicle.mass.inverse() * wrench).norm(), 1e-9 * wrench.norm());
}

TEST(VehicleDynamics, HasRightingMoment) {
  auto vehicle = some_vehicle<3>();
  vehicle.mass = 20.0 * Matrix<6, 6>::Identity();
  vehicle.weight = vehicle.buoyancy = 300.0;
  vehicle.centre_of_mass = {0.0, 0.0, -0.02};
  vehicle.centre_of_buoyancy.setZero();
  const SE3 heeling(SO3::Exp({0.3, 0.0, 0.0}), Vector<3>::Zero());
  Vector<6> r;
  VehicleDynamics<3>(vehicle, 1e-3)(heeling, Rn<6>(), Rn<6>(), R3(), R3(), R3(), r);
  const Vector<6> acceleration = -r / 1e-3;
  EXPECT_NEAR(acceleration[3], -300.0 * 0.02 * std::sin(0.3) / 20.0, 1e-12);
  EXPECT_LE(acceleration.head<3>().norm(), 1e-12);
}

TEST(VehicleDynamics, BodyDriftingWithTheCurrentHasNoForces) {
  auto vehicle = some_vehicle<3>();
  vehicle.weight = vehicle.buoyancy = 0.0;
  const SE3 pose = SE3::Exp(tangent<SE3>(1.2, 3.0));
  const Vector<3> current(0.5, -0.8, 0.1);
  Vector<6> drift = Vector<6>::Zero(), r;
  drift.head<3>() = pose.rotation().inverse().act(current);
  VehicleDynamics<3>(vehicle, 1.0)(pose, Rn<6>(drift), Rn<6>(drift), R3(), R3(), R3(current), r);
  EXPECT_LE(r.norm(), 1e-14);
}

TEST(ActuatorLag, HasCorrectJacobiansAndExactStepResponse) {
  const Vector<3> lag(0.0, 0.5, 2.0);
  const ActuatorLag<3> residual(lag, 0.7);
  expect_correct_jacobians_at_random_states(residual, 1);
  Vector<3> r;
  const Vector<3> from(0.2, -0.4, 1.0), to(1.0, 1.0, -1.0);
  residual(R3(from), R3(to), R3(), r);
  for (int i = 0; i < 3; ++i) {
    const double decay = lag[i] > 0 ? std::exp(-0.7 / lag[i]) : 0.0;
    EXPECT_NEAR(-r[i], to[i] + decay * (from[i] - to[i]), 1e-15);
  }
  EXPECT_EQ(residual.decay[0], 0.0);  // follows at once without a lag
}

}  // namespace
}  // namespace tandem::testing
