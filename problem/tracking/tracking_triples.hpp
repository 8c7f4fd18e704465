#pragma once

#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/mixed_constant_velocity.hpp>

namespace tandem::detail {

/// Variance per second of a triple against that of neighbours (1, 1), when what disturbs the motion is independent from
/// one keyframe to the next: the disturbances in between add up. With several horizons, which see the same disturbances
/// again, each counts for its share, so that together they say no more than one would.
inline double variance_ratio(const Horizon& h) {
  const double m = h.back, n = h.ahead;
  return ((n + 1) * (2 * n + 1) + n * (m - 1) * (2 * m - 1) / m) / 6;
}

template <LieGroup G>
void TrackingBuild<G>::add_triples(std::size_t last) {
  using PoseOrPoint = std::variant<Variable<G>, Variable<Point>>;
  const auto& noise = data.noise;
  const auto pose_or_point = [&](std::size_t k) -> PoseOrPoint {
    if (twin[k]) return *twin[k];
    if (pose(k)) return *pose(k);
    return std::get<Variable<Point>>(target[k]);
  };
  for (const Horizon& h : options.horizons) {
    const auto back = std::size_t(h.back), ahead = std::size_t(h.ahead);
    if (last < back + ahead) continue;
    const std::size_t k = last - ahead, first = k - back;
    const double dt1 = dt(first, k), dt2 = dt(k, last);
    const double scale = std::sqrt(variance_ratio(h) * double(options.horizons.size()) * dt2);
    const auto *x0 = pose(first), *x1 = pose(k), *x2 = pose(last);
    if (x0 && x1 && x2) {
      const Gaussian twist = noise_of("constant_twist", noise.constant_twist, G::dof);
      minimize(ConstantTwist<G>{dt1, dt2}, "constant_twist", twist.scaled(scale), {*x0, *x1, *x2});
      continue;
    }
    const Gaussian velocity = noise_of("constant_velocity", noise.constant_velocity, G::point_dim);
    std::visit(
        [&]<LieGroup A, LieGroup B, LieGroup C>(const Variable<A>& a, const Variable<B>& b, const Variable<C>& c) {
          minimize(MixedConstantVelocity<A, B, C>{dt1, dt2}, "constant_velocity", velocity.scaled(scale), {a, b, c});
        },
        pose_or_point(first), pose_or_point(k), pose_or_point(last));
  }
}

}  // namespace tandem::detail
