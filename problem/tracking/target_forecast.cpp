#include <algorithm>

#include <tandem/problem/tracking/carried_covariance.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/target_forecast.hpp>
#include <tandem/problem/tracking/tracking_constraints.hpp>
#include <tandem/problem/tracking/tracking_motion.hpp>

namespace tandem::detail {
namespace {

constexpr double kSliver = 1e-6;  // s: what rounding may leave of the last step, and no step
constexpr double kMostSteps = 1000;

/// f(dt) for each step until h [s], until it says false; longer ones than the interval where there would be too many.
template <class F>
bool each_step(double h, double interval, F f) {
  const double step = std::max(interval, h / kMostSteps);
  for (double left = h; left > kSliver; left -= step)
    if (!f(std::min(left, step))) return false;
  return true;
}

/// Of the target, a pose or a point, and, of a pose, E rows of its twist now: their joint covariance is that of
/// [chaser; before; now; twist].
template <LieGroup X, int E>
struct Carried {
  static constexpr int D = X::dof, T = 2 * D + E;

  X before, now;
  Vector<E> twist;
  CarriedCovariance joint;

  /// By a motion that ties three of them.
  template <class Motion>
  bool go_on(const Motion& motion, const Vector<D>& sigma) {
    Vector<D> e;
    motion(before, now, now, e);  // were it to stay: all of its way is missing
    const X next = now * X::Exp(-e);
    Matrix<D, D> J0, J1;
    motion(before, now, next, e, &J0, &J1);
    before = now;
    now = next;
    Matrix<D, 2 * D> by;
    by << -J0, -J1;  // that by the next is I where e vanishes
    const Matrix<D, D> noise = sigma.cwiseAbs2().asDiagonal();
    return joint.carry(by, noise, X::point_dim);
  }

  /// As of the covariance.
  void take_in(const CarriedCovariance::GivenVector& r, int first, const CarriedCovariance::Given& J,
               const CarriedCovariance::GivenVector& sigma) {
    const Vector<T> by = joint.take_in(r, first, J, sigma);
    before = before * X::Exp(by.template head<D>());
    now = now * X::Exp(by.template segment<D>(D));
    twist += by.template tail<E>();
  }

  /// What is known of the newest pose, and of the step to it.
  void take_in_constraints(const TrackingOptions& options, const TrackingNoise& noise, double dt) {
    each_attitude_constraint<X>(options, noise, [&]<class R>(const R& residual, Role role, auto, const auto& sigma) {
      if (role == Role::off) return;
      Vector<R::dim> r;
      Matrix<R::dim, D> J;
      residual(now, r, &J);
      take_in(r, D, J, sigma);
    });
    const auto hold = [&]<class R>(const R& residual, Role role, const auto& sigma) {
      if (role == Role::off) return;
      Vector<R::dim> r;
      Matrix<R::dim, D> J0, J1;
      residual(before, now, r, &J0, &J1);
      Matrix<R::dim, 2 * D> J;
      J << J0, J1;
      take_in(r, 0, J, sigma);
    };
    each_twist_constraint<X>(
        options, noise, dt,
        [&](const auto& residual, Role role, auto, const auto& sigma) { hold(residual, role, sigma); },
        [&](const auto& residual, Role role, const auto& bounds, auto, const auto& sigma) {
          hold(Outside(residual, bounds), role, sigma);
        });
  }

  /// Of a chaser that is a G.
  template <LieGroup G>
  TargetForecast<G> result() const {
    const Matrix<G::point_dim, D> by = now.act_jacobian(Vector<G::point_dim>::Zero());
    return {TargetState(in_space(now)), joint.of_newest(by)};
  }
};

}  // namespace

template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const PoseForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h) {
  constexpr int D = G::dof;
  Carried<G, 0> poses{start.before, start.now, {}, {start.covariance, D, D}};
  double last = start.dt;
  const bool known = each_step(h, interval, [&](double dt) {
    bool there = false;
    const auto move = [&](const auto& motion, const NoiseEntry& entry, const Vector<D>& scale) {
      there = poses.go_on(motion, scale.cwiseProduct(entry.sigma));
    };
    with_twist_motion<G>(options.model, noise, last, dt, move);
    if (there) poses.take_in_constraints(options, noise, dt);
    last = dt;
    return there;
  });
  return known ? std::optional(poses.template result<G>()) : std::nullopt;
}

template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const TwistForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h) {
  constexpr int D = G::dof;
  // The pose before has no say in what comes: the first step makes one.
  Matrix<4 * D, 4 * D> joint = Matrix<4 * D, 4 * D>::Zero();
  joint.template topLeftCorner<D, D>() = start.covariance.template topLeftCorner<D, D>();
  joint.template topRightCorner<D, 2 * D>() = start.covariance.template topRightCorner<D, 2 * D>();
  joint.template bottomLeftCorner<2 * D, D>() = start.covariance.template bottomLeftCorner<2 * D, D>();
  joint.template bottomRightCorner<2 * D, 2 * D>() = start.covariance.template bottomRightCorner<2 * D, 2 * D>();
  Carried<G, D> poses{start.now, start.now, start.twist.vector(), {joint, D, D}};
  const bool known = each_step(h, interval, [&](double dt) {
    bool there = false;
    const auto move = [&](const WhiteNoiseAcceleration<G>& motion, const NoiseEntry&, const auto& covariance) {
      const Rn<D> twist(poses.twist);
      const G next = poses.now * G::Exp(dt * poses.twist);
      Vector<2 * D> e;
      Matrix<2 * D, D> J0, Jw0, J1, Jw1;
      motion(poses.now, twist, next, twist, e, &J0, &Jw0, &J1, &Jw1);
      poses.before = poses.now;
      poses.now = next;
      Matrix<2 * D, 2 * D> by_next;
      by_next << J1, Jw1;
      Matrix<2 * D, 3 * D> by;
      by << Matrix<2 * D, D>::Zero(), J0, Jw0;
      there = poses.joint.carry(by_next, by, covariance, G::point_dim);
    };
    with_rate_motion<G>(noise, dt, move);
    if (there) poses.take_in_constraints(options, noise, dt);
    return there;
  });
  return known ? std::optional(poses.template result<G>()) : std::nullopt;
}

template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const PointForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h) {
  constexpr int P = G::point_dim;
  using Point = Rn<P>;
  Carried<Point, 0> points{start.before, start.now, {}, {start.covariance, G::dof, P}};
  double last = start.dt;
  const bool known = each_step(h, interval, [&](double dt) {
    bool there = false;
    const auto move = [&](const Vector<P>& share, const NoiseEntry& entry, const Vector<P>& scale) {
      there = points.go_on(MixedVelocity<Point, Point, Point>{share}, scale.cwiseProduct(entry.sigma));
    };
    with_velocity_motion<P>(options.model, noise, last, dt, move);
    last = dt;
    return there;
  });
  return known ? std::optional(points.template result<G>()) : std::nullopt;
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
