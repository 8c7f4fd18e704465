#pragma once

#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/mixed_velocity.hpp>

namespace tandem::detail {

/// Variance per second of a triple against that of neighbours (1, 1), when what disturbs the motion is independent from
/// one keyframe to the next: the disturbances in between add up. With several horizons, which see the same disturbances
/// again, each counts for its share, so that together they say no more than one would.
inline double variance_ratio(const Horizon& h) {
  const double m = h.back, n = h.ahead;
  return ((n + 1) * (2 * n + 1) + n * (m - 1) * (2 * m - 1) / m) / 6;
}

/// A triple (first, k, last) that ends a horizon.
struct Triple {
  std::size_t first, k, last;
  double dt1, dt2;  ///< s
};

template <LieGroup G>
class TripleBuild {
 public:
  explicit TripleBuild(TrackingBuild<G>& build) : build_(build), noise_(build.data.noise) {}

  void add(const Horizon& h, const Triple& at) {
    const double shares = double(build_.options.horizons.size());
    const auto *x0 = build_.pose(at.first), *x1 = build_.pose(at.k), *x2 = build_.pose(at.last);
    const bool poses = x0 && x1 && x2;
    const MotionModel model = build_.options.model;
    if (model == MotionModel::damped_twist || model == MotionModel::damped_velocity) {
      poses ? add_damped_twist(at, shares, {*x0, *x1, *x2}) : add_damped_velocity(at, shares);
      return;
    }
    const double scale = std::sqrt(variance_ratio(h) * shares * at.dt2);
    if (poses) {
      const Gaussian twist = noise_of("constant_twist", noise_.constant_twist, G::dof);
      build_.minimize(ConstantTwist<G>{at.dt1, at.dt2}, "constant_twist", twist.scaled(scale), {*x0, *x1, *x2});
      return;
    }
    const Gaussian velocity = noise_of("constant_velocity", noise_.constant_velocity, G::point_dim);
    add_velocity(at, MixedVelocity<Point, Point, Point>::constant(at.dt1, at.dt2).share, velocity.scaled(scale));
  }

 private:
  using Point = typename TrackingBuild<G>::Point;

  void add_damped_twist(const Triple& at, double shares, const VariablesOf<DampedTwist<G>>& x) {
    const bool by_twist = noise_.acceleration.isZero(0);
    const Eigen::VectorXd& sigma = by_twist ? noise_.constant_twist : noise_.acceleration;
    const Gaussian gaussian = noise_of("acceleration (or constant_twist)", sigma, G::dof);
    noise_of("twist_time", noise_.twist_time, G::dof);
    const Vector<G::dof> time = noise_.twist_time;
    const Eigen::VectorXd spread = std::sqrt(shares) * DampedTwist<G>::spread(at.dt1, at.dt2, time);
    build_.minimize(DampedTwist<G>::over(at.dt1, at.dt2, time), by_twist ? "constant_twist" : "acceleration",
                    gaussian.scaled(spread), x);
  }

  void add_damped_velocity(const Triple& at, double shares) {
    const Gaussian gaussian = noise_of("constant_velocity", noise_.constant_velocity, G::point_dim);
    noise_of("velocity_time", noise_.velocity_time, G::point_dim);
    const Vector<G::point_dim> time = noise_.velocity_time;
    const Eigen::VectorXd spread = std::sqrt(shares) * DampedTwist<Point>::spread(at.dt1, at.dt2, time);
    add_velocity(at, MixedVelocity<Point, Point, Point>::damped(at.dt1, at.dt2, time).share, gaussian.scaled(spread));
  }

  /// Over whatever the target is at the three, poses or points.
  void add_velocity(const Triple& at, const Vector<G::point_dim>& share, const Gaussian& noise) {
    std::visit(
        [&]<LieGroup A, LieGroup B, LieGroup C>(const Variable<A>& a, const Variable<B>& b, const Variable<C>& c) {
          build_.minimize(MixedVelocity<A, B, C>{share}, "constant_velocity", noise, {a, b, c});
        },
        pose_or_point(at.first), pose_or_point(at.k), pose_or_point(at.last));
  }

  std::variant<Variable<G>, Variable<Point>> pose_or_point(std::size_t k) const {
    if (build_.twin[k]) return *build_.twin[k];
    if (build_.pose(k)) return *build_.pose(k);
    return std::get<Variable<Point>>(build_.target[k]);
  }

  TrackingBuild<G>& build_;
  const TrackingNoise& noise_;
};

template <LieGroup G>
void TrackingBuild<G>::add_triples(std::size_t last) {
  for (const Horizon& h : options.horizons) {
    const auto back = std::size_t(h.back), ahead = std::size_t(h.ahead);
    if (last < back + ahead) continue;
    const std::size_t k = last - ahead, first = k - back;
    TripleBuild<G>(*this).add(h, {first, k, last, dt(first, k), dt(k, last)});
  }
}

}  // namespace tandem::detail
