#pragma once

#include <cmath>
#include <string_view>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/mixed_velocity.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

/// Residuals and noise of the target's motion models, for the problem builder and for forecasts.
namespace tandem::detail {

/// Throws Error, which mentions `name`, if `sigma` is not `size` positive finite numbers.
void check_noise(std::string_view name, const Eigen::VectorXd& sigma, int size);

/// A named entry of TrackingNoise.
struct NoiseEntry {
  std::string_view name;
  const Eigen::VectorXd& sigma;
};

/// Returns the entry `acceleration`, or constant_twist if that is zero.
inline NoiseEntry acceleration_of(const TrackingNoise& noise, int size) {
  const bool by_twist = noise.acceleration.isZero(0);
  const NoiseEntry entry =
      by_twist ? NoiseEntry{"constant_twist", noise.constant_twist} : NoiseEntry{"acceleration", noise.acceleration};
  check_noise("acceleration (or constant_twist)", entry.sigma, size);
  return entry;
}

inline bool is_damped(MotionModel model) {
  return model == MotionModel::damped_twist || model == MotionModel::damped_velocity;
}

/// Calls f(residual, entry, scale) for the model of three consecutive poses, dt1 and dt2 [s] apart. The standard
/// deviations are those of the entry, multiplied elementwise by `scale`. Throws Error if they are not given.
template <LieGroup G, class F>
void with_twist_motion(MotionModel model, const TrackingNoise& noise, double dt1, double dt2, F f) {
  if (is_damped(model)) {
    const NoiseEntry entry = acceleration_of(noise, G::dof);
    check_noise("twist_time", noise.twist_time, G::dof);
    const Vector<G::dof> time = noise.twist_time;
    f(DampedTwist<G>::over(dt1, dt2, time), entry, Vector<G::dof>(DampedTwist<G>::noise_scale(dt1, dt2, time)));
  } else {
    check_noise("constant_twist", noise.constant_twist, G::dof);
    f(ConstantTwist<G>{dt1, dt2}, NoiseEntry{"constant_twist", noise.constant_twist},
      Vector<G::dof>(Vector<G::dof>::Constant(std::sqrt(dt2))));
  }
}

/// Calls f(share, entry, scale) for the model of three consecutive positions with N coordinates. `share` is
/// MixedVelocity::share; otherwise as with_twist_motion().
template <int N, class F>
void with_velocity_motion(MotionModel model, const TrackingNoise& noise, double dt1, double dt2, F f) {
  using Point = Rn<N>;
  using Velocity = MixedVelocity<Point, Point, Point>;
  const NoiseEntry entry{"constant_velocity", noise.constant_velocity};
  check_noise(entry.name, entry.sigma, N);
  if (is_damped(model)) {
    check_noise("velocity_time", noise.velocity_time, N);
    const Vector<N> time = noise.velocity_time;
    f(Velocity::damped(dt1, dt2, time).gain, entry, Vector<N>(DampedTwist<Point>::noise_scale(dt1, dt2, time)));
  } else {
    f(Velocity::constant(dt1, dt2).gain, entry, Vector<N>(Vector<N>::Constant(std::sqrt(dt2))));
  }
}

/// Calls f(residual, entry, covariance) for white noise on acceleration, between two poses and twists dt [s] apart.
template <LieGroup G, class F>
void with_rate_motion(const TrackingNoise& noise, double dt, F f) {
  using Motion = WhiteNoiseAcceleration<G>;
  const NoiseEntry entry = acceleration_of(noise, G::dof);
  const Vector<G::dof> densities = entry.sigma.cwiseAbs2();
  f(Motion{dt}, entry, Motion::covariance(densities, dt));
}

}  // namespace tandem::detail
