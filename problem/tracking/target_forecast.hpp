#pragma once

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem::detail {

/// Where a target will be when nothing is measured of it any more, as its problem would have it: keyframe by keyframe, each
/// as long after the one before as the longest time without one, the target moves by its model of the motion, whose noise
/// adds up, and stays what is known of it (level, not sideways, within limits). A Kalman filter's prediction and updates
/// through the residuals' own Jacobians; with several horizons, which say no more than one, by neighbours. Beside the
/// target, its covariance has the chaser's newest pose, of which the target is seen.
template <LieGroup G>
struct TargetForecast {
  static constexpr int N = G::dof + G::point_dim;

  TargetState state;
  /// Of [the chaser's newest pose, by right perturbations; the target's position then, in the world] [m, rad].
  Matrix<N, N> covariance;
};

/// Of a target that is a pose: at the last two keyframes, `dt` [s] apart.
template <LieGroup G>
struct PoseForecastStart {
  G before, now;
  double dt;
  /// Of [the chaser's newest pose; before; now], right perturbations.
  Matrix<3 * G::dof, 3 * G::dof> covariance;
};
/// By its body twist: at the last keyframe alone.
template <LieGroup G>
struct TwistForecastStart {
  G now;
  Rn<G::dof> twist;
  /// Of [the chaser's newest pose; now; twist].
  Matrix<3 * G::dof, 3 * G::dof> covariance;
};
/// Of a target that is, or is to be, a point.
template <LieGroup G>
struct PointForecastStart {
  using Point = Rn<G::point_dim>;
  static constexpr int N = G::dof + 2 * G::point_dim;

  Point before, now;
  double dt;
  Matrix<N, N> covariance;  ///< as of poses
};

/// `h` [s], finite, ahead by steps of `interval` [s], a thousand at most, and what is left of the last. Nothing where
/// rounding would hide the covariance: what the position has to do with a direction that nothing observes, such as that
/// in which the target faces, cancels in theory. Throws Error where noise that the model needs is not given, or a residual
/// is undefined.
template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const PoseForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h);
template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const TwistForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h);
template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const PointForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h);

}  // namespace tandem::detail
