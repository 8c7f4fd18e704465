#pragma once

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem::detail {

/// Predicted target without further measurements, with its covariance.
///
/// The prediction is a Kalman filter that uses the Jacobians of the tracking residuals. It steps from keyframe to
/// keyframe: the motion model predicts the target and adds its noise, and the constraints of the options act as
/// measurements. Only the horizon (1, 1) is used. The covariance includes the chaser's newest pose, because target and
/// chaser are correlated.
template <LieGroup G>
struct TargetForecast {
  static constexpr int N = G::dof + G::point_dim;

  TargetState state;
  /// Covariance of [chaser's newest pose, right perturbation; predicted target position in the world] [m, rad].
  Matrix<N, N> covariance;
};

/// Initial state of a forecast with poses: the target at the last two keyframes, dt [s] apart.
template <LieGroup G>
struct PoseForecastStart {
  G before, now;
  double dt;
  /// Covariance of [chaser's newest pose; before; now], right perturbations.
  Matrix<3 * G::dof, 3 * G::dof> covariance;
};
/// Initial state of a forecast with body twists: pose and twist at the last keyframe.
template <LieGroup G>
struct TwistForecastStart {
  G now;
  Rn<G::dof> twist;
  /// Covariance of [chaser's newest pose; now; twist].
  Matrix<3 * G::dof, 3 * G::dof> covariance;
};
/// Initial state of a forecast with points: the target at the last two keyframes, dt [s] apart.
template <LieGroup G>
struct PointForecastStart {
  using Point = Rn<G::point_dim>;
  static constexpr int N = G::dof + 2 * G::point_dim;

  Point before, now;
  double dt;
  Matrix<N, N> covariance;  ///< covariance of [chaser's newest pose; before; now]
};

/// Forecasts the target `h` [s] ahead, in steps of `interval` [s]; `h` must be finite. Steps are longer if more than
/// 1000 would be needed. Returns nullopt if rounding errors dominate the covariance. This happens if an unobservable
/// direction, such as the target's heading, correlates with the position: its terms cancel only in exact arithmetic.
/// Throws Error if a required noise is not given or a residual is undefined.
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
