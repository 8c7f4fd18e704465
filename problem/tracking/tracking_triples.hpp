#pragma once

#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/problem/tracking/tracking_motion.hpp>

namespace tandem::detail {

/// Returns the ratio of the variance per second of a triple to that of the triple (1, 1). The disturbances of the
/// motion are independent between keyframes, so a wider triple sums several of them.
inline double variance_ratio(const Horizon& h) {
  const double m = h.back, n = h.ahead;
  return ((n + 1) * (2 * n + 1) + n * (m - 1) * (2 * m - 1) / m) / 6;
}

/// Keyframes (first, k, last) of a triple.
struct Triple {
  std::size_t first, k, last;
  double dt1, dt2;  ///< s
};

/// Adds triples to a problem. Several horizons contain the same disturbances, so they share the information equally.
template <LieGroup G>
class TripleBuild {
 public:
  explicit TripleBuild(TrackingBuild<G>& build) : build_(build), noise_(build.data.noise) {}

  void add(const Horizon& h, const Triple& at) {
    const double shares = double(build_.options.horizons.size());
    const auto *x0 = build_.pose(at.first), *x1 = build_.pose(at.k), *x2 = build_.pose(at.last);
    const bool poses = x0 && x1 && x2;
    const MotionModel model = build_.options.model;
    // The noise of damped models already accounts for the length of the intervals.
    const double factor = std::sqrt(is_damped(model) ? shares : variance_ratio(h) * shares);
    const auto noise = [&](const NoiseEntry& entry, const auto& scale) {
      return Gaussian(entry.sigma).scaled(Eigen::VectorXd(factor * scale));
    };
    if (poses) {
      with_twist_motion<G>(model, noise_, at.dt1, at.dt2,
                           [&](const auto& motion, const NoiseEntry& entry, const auto& scale) {
                             build_.minimize(motion, entry.name, noise(entry, scale), {*x0, *x1, *x2});
                           });
    } else {
      with_velocity_motion<G::point_dim>(model, noise_, at.dt1, at.dt2,
                                         [&](const auto& share, const NoiseEntry& entry, const auto& scale) {
                                           add_velocity(at, share, entry.name, noise(entry, scale));
                                         });
    }
  }

 private:
  using Point = typename TrackingBuild<G>::Point;

  /// Adds MixedVelocity for any combination of poses and points.
  void add_velocity(const Triple& at, const Vector<G::point_dim>& share, std::string_view entry,
                    const Gaussian& noise) {
    std::visit(
        [&]<LieGroup A, LieGroup B, LieGroup C>(const Variable<A>& a, const Variable<B>& b, const Variable<C>& c) {
          build_.minimize(MixedVelocity<A, B, C>{share}, entry, noise, {a, b, c});
        },
        build_.pose_or_point(at.first), build_.pose_or_point(at.k), build_.pose_or_point(at.last));
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
