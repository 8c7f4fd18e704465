#include <algorithm>

#include <tandem/problem/tracking/forecast_covariance.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/target_forecast.hpp>
#include <tandem/problem/tracking/tracking_constraints.hpp>
#include <tandem/problem/tracking/tracking_motion.hpp>

namespace tandem::detail {
namespace {

constexpr double kMinStep = 1e-6;  // s; a shorter last step is a rounding error
constexpr double kMaxSteps = 1000;
constexpr double kHardSigma = 1e-6;  // of a hard constraint, in its own unit; 0 would make an inactive one singular

/// Calls f(dt) for each step up to h [s], until f returns false. Returns whether all calls returned true.
template <class F>
bool each_step(double h, double interval, F f) {
  const double step = std::max(interval, h / kMaxSteps);
  for (double left = h; left > kMinStep; left -= step)
    if (!f(std::min(left, step))) return false;
  return true;
}

/// Kalman filter of the target, a pose or a point, and of E rows of its twist. The joint covariance is that of
/// [chaser; before; now; twist].
template <LieGroup X, int E>
struct ForecastFilter {
  static constexpr int D = X::dof, T = 2 * D + E;

  X before, now;
  Vector<E> twist;
  ForecastCovariance joint;

  /// Predicts the next state by a motion residual of three states. Returns false if the covariance is lost in rounding.
  template <class Motion>
  bool predict(const Motion& motion, const Vector<D>& sigma) {
    Vector<D> e;
    motion(before, now, now, e);  // residual of a target that does not move, which is minus its motion
    const X next = now * X::Exp(-e);
    Matrix<D, D> J0, J1;
    motion(before, now, next, e, &J0, &J1);
    before = now;
    now = next;
    Matrix<D, 2 * D> J;
    J << -J0, -J1;  // the Jacobian with respect to `next` is I, because e is 0
    const Matrix<D, D> noise = sigma.cwiseAbs2().asDiagonal();
    return joint.predict(J, noise, X::point_dim);
  }

  /// Applies a measurement; for the arguments, see ForecastCovariance::update().
  void update(const ForecastCovariance::GivenVector& r, int first, const ForecastCovariance::Given& J,
              const ForecastCovariance::GivenVector& sigma) {
    const Vector<T> correction = joint.update(r, first, J, sigma);
    before = before * X::Exp(correction.template head<D>());
    now = now * X::Exp(correction.template segment<D>(D));
    twist += correction.template tail<E>();
  }

  template <class S>
  static S sigma_of(Role role, const S& sigma) {
    return role == Role::hard ? S(S::Constant(sigma.size(), kHardSigma)) : sigma;
  }

  /// Applies the constraints on the newest pose and on the twist of the last step.
  void update_constraints(const TrackingOptions& options, const TrackingNoise& noise, double dt) {
    each_attitude_constraint<X>(options, noise, [&]<class R>(const R& residual, Role role, auto, const auto& sigma) {
      if (role == Role::off) return;
      Vector<R::dim> r;
      Matrix<R::dim, D> J;
      residual(now, r, &J);
      update(r, D, J, sigma_of(role, sigma));
    });
    const auto hold = [&]<class R>(const R& residual, Role role, const auto& sigma) {
      if (role == Role::off) return;
      Vector<R::dim> r;
      Matrix<R::dim, D> J0, J1;
      residual(before, now, r, &J0, &J1);
      Matrix<R::dim, 2 * D> J;
      J << J0, J1;
      update(r, 0, J, sigma_of(role, sigma));
    };
    each_twist_constraint<X>(
        options, noise, dt,
        [&](const auto& residual, Role role, auto, const auto& sigma) { hold(residual, role, sigma); },
        [&](const auto& residual, Role role, const auto& bounds, auto, const auto& sigma) {
          hold(SoftBound(residual, bounds), role, sigma);
        });
  }

  /// Returns the forecast for a chaser pose of type G.
  template <LieGroup G>
  TargetForecast<G> result() const {
    const Matrix<G::point_dim, D> J = now.act_jacobian(Vector<G::point_dim>::Zero());
    return {TargetState(in_space(now)), joint.of_newest(J)};
  }
};

}  // namespace

template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const PoseForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h) {
  constexpr int D = G::dof;
  ForecastFilter<G, 0> poses{start.before, start.now, {}, {start.covariance, D, D}};
  double last = start.dt;
  const bool all_valid = each_step(h, interval, [&](double dt) {
    bool valid = false;
    const auto move = [&](const auto& motion, const NoiseEntry& entry, const Vector<D>& scale) {
      valid = poses.predict(motion, scale.cwiseProduct(entry.sigma));
    };
    with_twist_motion<G>(options.model, noise, last, dt, move);
    if (valid) poses.update_constraints(options, noise, dt);
    last = dt;
    return valid;
  });
  return all_valid ? std::optional(poses.template result<G>()) : std::nullopt;
}

template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const TwistForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h) {
  constexpr int D = G::dof;
  // The motion does not depend on the pose before, so its covariance is zero until the first step.
  Matrix<4 * D, 4 * D> joint = Matrix<4 * D, 4 * D>::Zero();
  joint.template topLeftCorner<D, D>() = start.covariance.template topLeftCorner<D, D>();
  joint.template topRightCorner<D, 2 * D>() = start.covariance.template topRightCorner<D, 2 * D>();
  joint.template bottomLeftCorner<2 * D, D>() = start.covariance.template bottomLeftCorner<2 * D, D>();
  joint.template bottomRightCorner<2 * D, 2 * D>() = start.covariance.template bottomRightCorner<2 * D, 2 * D>();
  ForecastFilter<G, D> poses{start.now, start.now, start.twist.vector(), {joint, D, D}};
  const bool all_valid = each_step(h, interval, [&](double dt) {
    bool valid = false;
    const auto move = [&](const WhiteNoiseAcceleration<G>& motion, const NoiseEntry&, const auto& covariance) {
      const Rn<D> twist(poses.twist);
      const G next = poses.now * G::Exp(dt * poses.twist);
      Vector<2 * D> e;
      Matrix<2 * D, D> J0, Jw0, J1, Jw1;
      motion(poses.now, twist, next, twist, e, &J0, &Jw0, &J1, &Jw1);
      poses.before = poses.now;
      poses.now = next;
      Matrix<2 * D, 2 * D> J_next;
      J_next << J1, Jw1;
      Matrix<2 * D, 3 * D> J;
      J << Matrix<2 * D, D>::Zero(), J0, Jw0;
      valid = poses.joint.predict(J_next, J, covariance, G::point_dim);
    };
    with_rate_motion<G>(noise, dt, move);
    if (valid) poses.update_constraints(options, noise, dt);
    return valid;
  });
  return all_valid ? std::optional(poses.template result<G>()) : std::nullopt;
}

template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const PointForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h) {
  constexpr int P = G::point_dim;
  using Point = Rn<P>;
  ForecastFilter<Point, 0> points{start.before, start.now, {}, {start.covariance, G::dof, P}};
  double last = start.dt;
  const bool all_valid = each_step(h, interval, [&](double dt) {
    bool valid = false;
    const auto move = [&](const Vector<P>& share, const NoiseEntry& entry, const Vector<P>& scale) {
      valid = points.predict(MixedVelocity<Point, Point, Point>{share}, scale.cwiseProduct(entry.sigma));
    };
    with_velocity_motion<P>(options.model, noise, last, dt, move);
    last = dt;
    return valid;
  });
  return all_valid ? std::optional(points.template result<G>()) : std::nullopt;
}

template std::optional<TargetForecast<SE3>> forecast(const PoseForecastStart<SE3>&, const TrackingOptions&,
                                                     const TrackingNoise&, double, double);
template std::optional<TargetForecast<SE2>> forecast(const PoseForecastStart<SE2>&, const TrackingOptions&,
                                                     const TrackingNoise&, double, double);
template std::optional<TargetForecast<SE3>> forecast(const TwistForecastStart<SE3>&, const TrackingOptions&,
                                                     const TrackingNoise&, double, double);
template std::optional<TargetForecast<SE2>> forecast(const TwistForecastStart<SE2>&, const TrackingOptions&,
                                                     const TrackingNoise&, double, double);
template std::optional<TargetForecast<SE3>> forecast(const PointForecastStart<SE3>&, const TrackingOptions&,
                                                     const TrackingNoise&, double, double);
template std::optional<TargetForecast<SE2>> forecast(const PointForecastStart<SE2>&, const TrackingOptions&,
                                                     const TrackingNoise&, double, double);

}  // namespace tandem::detail
