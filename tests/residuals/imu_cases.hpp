#pragma once

#include <random>
#include <vector>

#include <tandem/residuals/imu_preintegration.hpp>

namespace tandem::testing {

/// Inertial measurement that is constant over dt.
struct Reading {
  Vector<3> specific_force, angular_rate;
  double dt;
};

inline std::vector<Reading> random_readings(unsigned seed, int count, double dt) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Reading> readings;
  Vector<3> f(0.5, -0.3, 9.9), w(0.2, -0.4, 0.6);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) f[k] += 0.3 * normal(random), w[k] += 0.1 * normal(random);
    readings.push_back({f, w, dt * (1.0 + 0.5 * (i % 3))});
  }
  return readings;
}

inline void add(ImuPreintegrator& sum, const std::vector<Reading>& readings) {
  for (const Reading& reading : readings) sum.integrate(reading.specific_force, reading.angular_rate, reading.dt);
}

/// A mount with lever arm and rotation, and noise for which no covariance entry is negligible.
inline SE3 tilted_mount() { return SE3(SO3::Exp({0.7, -0.4, 1.9}), Vector<3>(0.8, -0.3, 0.5)); }
inline Vector<6> some_bias() { return (Vector<6>() << 0.1, -0.2, 0.15, 0.02, -0.01, 0.03).finished(); }
inline ImuNoise some_noise() { return {2e-3, 3e-4, 3e-3, 4e-4, 1e-4}; }

inline ImuDelta some_delta(double dt = 0.01, int count = 60) {
  ImuPreintegrator sum(tilted_mount(), some_noise(), some_bias());
  add(sum, random_readings(5, count, dt));
  return sum.delta();
}

}  // namespace tandem::testing
