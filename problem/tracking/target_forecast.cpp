#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/target_forecast.hpp>
#include <tandem/problem/tracking/tracking_constraints.hpp>
#include <tandem/problem/tracking/tracking_motion.hpp>

namespace tandem::detail {
namespace {

/// Of the terms that make a position's variance: what rounding leaves of terms that should cancel is as much of them.
constexpr double kMostCancelled = 1e8;

/// The joint covariance of the chaser's newest pose, C unknowns, and of the target: D before, and M now.
template <int C, int D, int M>
class Carried {
 public:
  static constexpr int T = D + M;

  explicit Carried(const Matrix<C + T, C + T>& covariance) : P_(covariance) {}

  /// What comes now is `by` times the target's unknowns, and noise; of what was now, the first D are before. False where
  /// nothing but rounding would be left of a variance of the first `positions` of what comes.
  bool carry(const Matrix<M, T>& by, const Matrix<M, M>& noise, int positions) {
    const Vector<M> terms = by.cwiseAbs2() * P_.diagonal().template tail<T>();
    const Matrix<M, C + T> cross = by * P_.template bottomRows<T>();
    const Matrix<C, D> of_chaser = P_.template block<C, D>(0, C + D);
    const Matrix<D, D> before = P_.template block<D, D>(C + D, C + D);
    P_.template block<C, D>(0, C) = of_chaser;
    P_.template block<D, C>(C, 0) = of_chaser.transpose();
    P_.template block<D, D>(C, C) = before;
    P_.template bottomLeftCorner<M, C>() = cross.template leftCols<C>();
    P_.template block<M, D>(C + D, C) = cross.template middleCols<D>(C + D);
    P_.template topRightCorner<C + D, M>() = P_.template bottomLeftCorner<M, C + D>().transpose();
    // Symmetric to the last bit, or rounding would grow with each step.
    const Matrix<M, M> own = cross.template rightCols<T>() * by.transpose();
    P_.template bottomRightCorner<M, M>() = 0.5 * (own + own.transpose()) + noise;
    const auto left = P_.diagonal().segment(C + D, positions).array();
    return (terms.head(positions).array() <= kMostCancelled * left).all();
  }

  /// r, which has these derivatives and deviations, is zero: the correction of the target's unknowns.
  template <int R>
  Vector<T> take_in(const Vector<R>& r, const Matrix<R, T>& J, const Vector<R>& sigma) {
    const Matrix<C + T, R> PJ = P_.template rightCols<T>() * J.transpose();
    Matrix<R, R> S = J * PJ.template bottomRows<T>();
    S.diagonal() += sigma.cwiseAbs2();
    const Eigen::LLT<Matrix<R, R>> root(S);
    const Matrix<R, C + T> gain = root.matrixL().solve(PJ.transpose());
    P_ -= gain.transpose() * gain;
    return -gain.template rightCols<T>().transpose() * root.matrixL().solve(r);
  }

  const Matrix<C + T, C + T>& covariance() const { return P_; }

 private:
  Matrix<C + T, C + T> P_;
};

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

/// Two poses and, where E > 0, the twist at the second, with their joint covariance [chaser; before; now; twist].
template <LieGroup G, int E>
struct CarriedPoses {
  static constexpr int C = G::dof, D = G::dof, M = D + E, T = D + M;

  G before, now;
  Vector<E> twist;
  Carried<C, D, M> joint;

  bool advance(const G& next, const Matrix<M, T>& by, const Matrix<M, M>& noise) {
    before = now;
    now = next;
    return joint.carry(by, noise, G::point_dim);
  }

  /// What is known of the newest pose, and of the step to it.
  void take_in_constraints(const TrackingOptions& options, const TrackingNoise& noise, double dt) {
    const auto move = [&](const Vector<T>& by) {
      before = before * G::Exp(by.template head<D>());
      now = now * G::Exp(by.template segment<D>(D));
      twist += by.template tail<E>();
    };
    each_attitude_constraint<G>(options, noise, [&]<class R>(const R& residual, Role role, auto, const auto& sigma) {
      if (role == Role::off) return;
      Vector<R::dim> r;
      Matrix<R::dim, D> J;
      residual(now, r, &J);
      Matrix<R::dim, T> all = Matrix<R::dim, T>::Zero();
      all.template middleCols<D>(D) = J;
      move(joint.template take_in<R::dim>(r, all, sigma));
    });
    const auto hold = [&]<class R>(const R& residual, Role role, const auto& sigma) {
      if (role == Role::off) return;
      Vector<R::dim> r;
      Matrix<R::dim, D> J0, J1;
      residual(before, now, r, &J0, &J1);
      Matrix<R::dim, T> all = Matrix<R::dim, T>::Zero();
      all.template leftCols<D>() = J0;
      all.template middleCols<D>(D) = J1;
      move(joint.template take_in<R::dim>(r, all, sigma));
    };
    each_twist_constraint<G>(
        options, noise, dt,
        [&](const auto& residual, Role role, auto, const auto& sigma) { hold(residual, role, sigma); },
        [&](const auto& residual, Role role, const auto& bounds, auto, const auto& sigma) {
          hold(Outside(residual, bounds), role, sigma);
        });
  }

  TargetForecast<G> result() const {
    constexpr int P = G::point_dim;
    Matrix<C + P, C + T> J = Matrix<C + P, C + T>::Zero();
    J.template topLeftCorner<C, C>().setIdentity();
    J.template block<P, D>(C, C + D) = now.act_jacobian(Vector<P>::Zero());
    return {TargetState(in_space(now)), J * joint.covariance() * J.transpose()};
  }
};

}  // namespace

template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const PoseForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h) {
  constexpr int D = G::dof;
  CarriedPoses<G, 0> poses{start.before, start.now, {}, Carried<D, D, D>(start.covariance)};
  double last = start.dt;
  const bool known = each_step(h, interval, [&](double dt) {
    bool there = false;
    const auto move = [&](const auto& motion, const NoiseEntry& entry, const Vector<D>& scale) {
      Vector<D> e;
      motion(poses.before, poses.now, poses.now, e);  // were it to stay: all of its way is missing
      const G next = poses.now * G::Exp(-e);
      Matrix<D, D> J0, J1;
      motion(poses.before, poses.now, next, e, &J0, &J1);
      Matrix<D, 2 * D> by;
      by << -J0, -J1;  // that by the next is I where e vanishes
      const Vector<D> variance = scale.cwiseProduct(entry.sigma).cwiseAbs2();
      there = poses.advance(next, by, variance.asDiagonal());
    };
    with_twist_motion<G>(options.model, noise, last, dt, move);
    if (there) poses.take_in_constraints(options, noise, dt);
    last = dt;
    return there;
  });
  return known ? std::optional(poses.result()) : std::nullopt;
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
  CarriedPoses<G, D> poses{start.now, start.now, start.twist.vector(), Carried<D, D, 2 * D>(joint)};
  const bool known = each_step(h, interval, [&](double dt) {
    bool there = false;
    const auto move = [&](const WhiteNoiseAcceleration<G>& motion, const NoiseEntry&, const auto& covariance) {
      const Rn<D> twist(poses.twist);
      const G next = poses.now * G::Exp(dt * poses.twist);
      Vector<2 * D> e;
      Matrix<2 * D, D> J0, Jw0, J1, Jw1;
      motion(poses.now, twist, next, twist, e, &J0, &Jw0, &J1, &Jw1);
      Matrix<2 * D, 2 * D> by_now, by_next;
      by_now << J0, Jw0;
      by_next << J1, Jw1;
      const Matrix<2 * D, 2 * D> inverse = by_next.inverse();
      Matrix<2 * D, 3 * D> by = Matrix<2 * D, 3 * D>::Zero();
      by.template rightCols<2 * D>() = -inverse * by_now;
      there = poses.advance(next, by, inverse * covariance * inverse.transpose());
    };
    with_rate_motion<G>(noise, dt, move);
    if (there) poses.take_in_constraints(options, noise, dt);
    return there;
  });
  return known ? std::optional(poses.result()) : std::nullopt;
}

template <LieGroup G>
std::optional<TargetForecast<G>> forecast(const PointForecastStart<G>& start, const TrackingOptions& options,
                                          const TrackingNoise& noise, double interval, double h) {
  constexpr int C = G::dof, P = G::point_dim;
  using Point = Rn<P>;
  Point before = start.before, now = start.now;
  double last = start.dt;
  Carried<C, P, P> joint(start.covariance);
  const bool known = each_step(h, interval, [&](double dt) {
    bool there = false;
    const auto move = [&](const Vector<P>& share, const NoiseEntry& entry, const Vector<P>& scale) {
      const MixedVelocity<Point, Point, Point> motion{share};
      Vector<P> e;
      Matrix<P, P> J0, J1;
      motion(before, now, now, e, &J0, &J1);
      before = now;
      now = now * Point::Exp(-e);
      Matrix<P, 2 * P> by;
      by << -J0, -J1;
      const Vector<P> variance = scale.cwiseProduct(entry.sigma).cwiseAbs2();
      there = joint.carry(by, variance.asDiagonal(), P);
    };
    with_velocity_motion<P>(options.model, noise, last, dt, move);
    last = dt;
    return there;
  });
  if (!known) return {};
  Matrix<C + P, C + 2 * P> newest = Matrix<C + P, C + 2 * P>::Zero();
  newest.template topLeftCorner<C, C>().setIdentity();
  newest.template bottomRightCorner<P, P>().setIdentity();
  return TargetForecast<G>{TargetState(in_space(now)), newest * joint.covariance() * newest.transpose()};
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
