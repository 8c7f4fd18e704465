#pragma once

#include <cmath>
#include <string_view>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/mixed_velocity.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

/// Which residual a model of the target's motion is, and its noise: for those who add it to a problem, and for those who
/// look ahead by it.
namespace tandem::detail {

/// Throws Error when standard deviations, by name, are not `size` positive numbers.
void check_noise(std::string_view name, const Eigen::VectorXd& sigma, int size);

/// An entry of TrackingNoise.
struct NoiseEntry {
  std::string_view name;
  const Eigen::VectorXd& sigma;
};

/// `acceleration`, or what stands for it where it is not given.
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

/// Of a model that ties triples, over three poses of neighbours in time, dt1 and dt2 [s] apart: f(residual, entry, scale),
/// the standard deviations being the entry's, each times its scale. Throws Error where these are not given.
template <LieGroup G, class F>
void with_twist_motion(MotionModel model, const TrackingNoise& noise, double dt1, double dt2, F f) {
  if (is_damped(model)) {
    const NoiseEntry entry = acceleration_of(noise, G::dof);
    check_noise("twist_time", noise.twist_time, G::dof);
    const Vector<G::dof> time = noise.twist_time;
    f(DampedTwist<G>::over(dt1, dt2, time), entry, Vector<G::dof>(DampedTwist<G>::spread(dt1, dt2, time)));
  } else {
    check_noise("constant_twist", noise.constant_twist, G::dof);
    f(ConstantTwist<G>{dt1, dt2}, NoiseEntry{"constant_twist", noise.constant_twist},
      Vector<G::dof>(Vector<G::dof>::Constant(std::sqrt(dt2))));
  }
}

/// The same over three positions of N coordinates: f(share, entry, scale), share that of MixedVelocity.
template <int N, class F>
void with_velocity_motion(MotionModel model, const TrackingNoise& noise, double dt1, double dt2, F f) {
  using Point = Rn<N>;
  using Velocity = MixedVelocity<Point, Point, Point>;
  const NoiseEntry entry{"constant_velocity", noise.constant_velocity};
  check_noise(entry.name, entry.sigma, N);
  if (is_damped(model)) {
    check_noise("velocity_time", noise.velocity_time, N);
    const Vector<N> time = noise.velocity_time;
    f(Velocity::damped(dt1, dt2, time).share, entry, Vector<N>(DampedTwist<Point>::spread(dt1, dt2, time)));
  } else {
    f(Velocity::constant(dt1, dt2).share, entry, Vector<N>(Vector<N>::Constant(std::sqrt(dt2))));
  }
}

/// Of white noise on acceleration, over two poses and twists dt [s] apart: f(residual, entry, covariance).
template <LieGroup G, class F>
void with_rate_motion(const TrackingNoise& noise, double dt, F f) {
  using Motion = WhiteNoiseAcceleration<G>;
  const NoiseEntry entry = acceleration_of(noise, G::dof);
  const Vector<G::dof> densities = entry.sigma.cwiseAbs2();
  f(Motion{dt}, entry, Motion::covariance(densities, dt));
}

}  // namespace tandem::detail
