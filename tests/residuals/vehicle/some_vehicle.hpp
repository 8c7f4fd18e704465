#pragma once

#include <random>

#include <tandem/residuals/vehicle/vehicle_model.hpp>

namespace tandem::testing {

inline Matrix<6, 6> random_definite(std::mt19937_64& random, double scale) {
  std::normal_distribution<double> normal;
  Matrix<6, 6> A;
  for (double& a : A.reshaped()) a = normal(random);
  return scale * (Matrix<6, 6>(A * A.transpose()) + 2.0 * Matrix<6, 6>::Identity());
}

/// Returns a vehicle with full matrices, so that every term and coupling contributes.
template <int N>
VehicleModel<N> some_vehicle(unsigned seed = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  VehicleModel<N> v;
  v.mass = random_definite(random, 2.0);
  v.linear = random_definite(random, 0.5);
  v.quadratic = random_definite(random, 0.3);
  v.lift = random_definite(random, 0.2);
  v.lift(0, 4) += 0.3;  // not symmetric
  v.weight = 290.0;
  v.buoyancy = 300.0;
  v.centre_of_mass = {0.02, -0.01, -0.03};
  v.centre_of_buoyancy = {-0.01, 0.005, 0.01};
  for (double& a : v.thrust.reshaped()) a = 3.0 * normal(random);
  for (double& a : v.fin.reshaped()) a = normal(random);
  for (int i = 0; i < N; ++i) v.lag[i] = 0.15 * i;  // the first actuator has no lag
  return v;
}

/// Returns a vehicle without damping, actuation and restoring forces.
template <int N>
VehicleModel<N> free_vehicle(unsigned seed = 1) {
  VehicleModel<N> v = some_vehicle<N>(seed);
  v.linear.setZero();
  v.quadratic.setZero();
  v.lift.setZero();
  v.thrust.setZero();
  v.fin.setZero();
  v.weight = v.buoyancy = 0.0;
  return v;
}

}  // namespace tandem::testing
