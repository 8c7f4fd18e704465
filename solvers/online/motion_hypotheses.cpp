#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include <tandem/lie/error.hpp>
#include <tandem/lie/wrapped_angle.hpp>
#include <tandem/residuals/ornstein_uhlenbeck.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>

namespace tandem {
namespace {

constexpr double kSameTime = 1e-3;           // s
constexpr double kMaxStep = 1.0;             // Longest integration step [s].
constexpr double kInitialSpeedSigma = 5.0;   // Standard deviation of the velocity at the first fix [m/s].
constexpr double kInitialSlopeSigma = 0.01;  // Standard deviation of the slopes at the first fix.
constexpr double kForgettingFactor = 0.85;   // Factor on the log-likelihood of a hypothesis, per fix.
// Limit of the log-likelihood ratio of noise scales, so that each can recover.
constexpr double kMaxDisadvantage = 30;
constexpr double kNegligibleWeight = 1e-4;  // Relative weight below which predictions omit a noise scale.
constexpr double kCourseFailed = 20;        // Log likelihood ratio at which a course is discarded.
constexpr double kNewCoursePenalty = 3;     // Subtracted from the initial log weight of a new course.
constexpr double kMovingThreshold = 2.5;    // Speed over its lateral standard deviation, above which a course begins.
constexpr double kCourseSigma = 0.05;       // σ of the heading about the direction of travel [rad].
constexpr double kMaxYawRateSigma = 0.1;    // Limit of σ of the initial yaw rate of a course [rad/s].
constexpr double kSwaySigma = 0.05;         // m/s
constexpr double kMinWeight = 1e-6;         // Least weight of a fix under its loss.
constexpr double kOutlier = 12;             // NIS beyond its mean, above which fixes are equally unlikely.
constexpr double kGapTime = 100;            // Decay time of the weights of the noise scales without fixes [s].
constexpr double kMaxSteps = 1000;          // Per prediction.

/// Updates a Kalman filter with rows H x = z, of innovation e and noise R, which the loss inflates. Returns the log
/// likelihood up to a constant. The likelihood uses R without inflation, which would reward filters that call a fix an
/// outlier. The NIS of a down-weighted fix is limited.
template <int D, int N>
double update_by(Vector<D>& x, Matrix<D, D>& P, const Matrix<N, D>& H, const Vector<N>& e, const Matrix<N, N>& R,
                 const Loss& loss) {
  const Matrix<D, N> PH = P * H.transpose();
  const Matrix<N, N> S = H * PH + R;
  Matrix<N, N> inverse = S.inverse();
  const double squares = e.dot(inverse * e), weight = std::max(loss(squares).d1, kMinWeight);
  if (weight != 1) inverse = (S + (1 / weight - 1) * R).inverse();
  const Matrix<D, N> K = PH * inverse;
  x += K * e;
  const Matrix<D, D> left = Matrix<D, D>::Identity() - K * H;  // Joseph form: stays positive after long gaps
  P = (left * P * left.transpose() + K * (R / weight) * K.transpose()).eval();
  P = (0.5 * (P + P.transpose())).eval();
  return -0.5 * ((weight != 1 ? std::min(squares, kOutlier + N) : squares) + std::log(S.determinant()));
}

/// log(exp(a) + exp(b))
double log_sum(double a, double b) { return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b))); }

}  // namespace

double MotionHypotheses::Pair::log_weight() const {
  return course ? log_sum(drift.log_weight, course->log_weight) : drift.log_weight;
}

MotionHypotheses::Pair MotionHypotheses::begin(const TargetFix& fix, const NoiseScale& scale) {
  Filter drift;
  drift.x.setZero();
  drift.x.head<3>() = fix.position;
  drift.P.setZero();
  drift.P.topLeftCorner<3, 3>() = fix.covariance;
  drift.P.diagonal().segment<2>(3).setConstant(kInitialSpeedSigma * kInitialSpeedSigma);
  drift.P.diagonal().tail<2>().setConstant(kInitialSlopeSigma * kInitialSlopeSigma);
  return {.scale = scale, .drift = drift, .course = {}};
}

MotionHypotheses::State MotionHypotheses::start(const TargetFix& fix) {
  State state;
  for (std::size_t i = 0; i < state.size(); ++i) state[i] = begin(fix, kScales[i]);
  return state;
}

/// Propagates the drift hypothesis. Steps are short compared with the time constant, so the process noise neglects the
/// decay within a step. The noise is never scaled below its given value, since this hypothesis is the fallback of a
/// failed course.
void MotionHypotheses::move_drift(Filter& f, double motion, double dt) const {
  const OrnsteinUhlenbeck velocity{noise_.drift_time};
  const double gain = -noise_.drift_time * std::expm1(-dt / noise_.drift_time);  // displacement per unit velocity
  const auto v = f.x.segment<2>(3), slope = f.x.tail<2>();
  Matrix<kDim, kDim> F = Matrix<kDim, kDim>::Identity();
  F(0, 3) = F(1, 4) = gain;
  F.block<1, 2>(2, 3) = gain * slope.transpose();
  F.block<1, 2>(2, 6) = gain * v.transpose();
  F(3, 3) = F(4, 4) = velocity.decay(dt);
  f.x.head<3>() += (gain * Vector<3>(v.x(), v.y(), slope.dot(v))).eval();
  f.x.segment<2>(3) *= F(3, 3);
  f.P = (F * f.P * F.transpose()).eval();
  const double root = std::max(motion, 1.0) * noise_.drift, q = root * root;
  Matrix<3, 2> plane;  // tangents of the plane along x and y
  plane << 1, 0, 0, 1, slope.x(), slope.y();
  Matrix<5, 5> Q;
  Q << q * dt * dt * dt / 3 * plane * plane.transpose(), q * dt * dt / 2 * plane,  //
      q * dt * dt / 2 * plane.transpose(), q * dt * Matrix<2, 2>::Identity();
  f.P.topLeftCorner<5, 5>() += Q;
}

/// Propagates the course hypothesis.
void MotionHypotheses::move_course(Filter& f, double motion, double dt) const {
  const double turned = -noise_.yaw_time * std::expm1(-dt / noise_.yaw_time);  // rotation per unit yaw rate
  const double middle = f.x[3] + 0.5 * turned * f.x[5], way = f.x[4] * dt;
  const auto slope = f.x.tail<2>();
  const Vector<2> forward(std::cos(middle), std::sin(middle));
  const Vector<3> along(forward.x(), forward.y(), slope.dot(forward));
  const Vector<3> across(-forward.y(), forward.x(), slope.x() * -forward.y() + slope.y() * forward.x());
  Matrix<kDim, kDim> F = Matrix<kDim, kDim>::Identity();
  F.block<3, 1>(0, 3) = way * across;
  F.block<3, 1>(0, 4) = dt * along;
  F.block<3, 1>(0, 5) = 0.5 * turned * way * across;
  F.block<1, 2>(2, 6) = way * forward.transpose();
  F(3, 5) = turned;
  F(5, 5) = OrnsteinUhlenbeck{noise_.yaw_time}.decay(dt);
  f.P = (F * f.P * F.transpose()).eval();
  f.x.head<3>() += way * along;
  f.x[3] += turned * f.x[5];
  f.x[5] *= F(5, 5);
  // White noise on the acceleration along the course and on the yaw acceleration, integrated over the step.
  const double surge = motion * noise_.surge, yaw = motion * noise_.yaw_rate, qs = surge * surge, qr = yaw * yaw;
  const double dt2 = dt * dt, dt3 = dt2 * dt;
  Matrix<6, 6> Q = Matrix<6, 6>::Zero();
  Q.topLeftCorner<3, 3>() =
      qs * dt3 / 3 * along * along.transpose() + qr * dt3 / 20 * way * way * across * across.transpose();
  Q.block<3, 1>(0, 4) = qs * dt2 / 2 * along;
  Q.block<3, 1>(0, 3) = qr * dt3 / 8 * way * across;
  Q.block<3, 1>(0, 5) = qr * dt2 / 6 * way * across;
  Q(3, 5) = qr * dt2 / 2;
  Q.diagonal().tail<3>() << qr * dt3 / 3, qs * dt, qr * dt;
  f.P.topLeftCorner<6, 6>() += Matrix<6, 6>(Q.selfadjointView<Eigen::Upper>());
}

void MotionHypotheses::move(Pair& pair, double dt) const {
  const auto wander = [&](Filter& f, double step) {
    f.P(2, 2) += noise_.climb * noise_.climb * step;
    f.P.diagonal().tail<2>().array() += noise_.tilt * noise_.tilt * step;
  };
  const double longest = std::max(kMaxStep, dt / kMaxSteps);
  for (double left = dt; left > 0; left -= longest) {
    const double step = std::min(left, longest);
    move_drift(pair.drift, pair.scale.motion, step);
    wander(pair.drift, step);
    if (pair.course) {
      move_course(*pair.course, pair.scale.motion, step);
      wander(*pair.course, step);
    }
    apply_limits(pair);
  }
}

/// Conditions the filters on the limits that they exceed.
void MotionHypotheses::apply_limits(Pair& pair) const {
  const auto hold = [](Filter& f, const Matrix<1, kDim>& H, double low, double high, double sigma) {
    const double value = H * f.x, by = std::clamp(value, low, high) - value, variance = sigma * sigma;
    if (by == 0) return;
    const double known = H * f.P * H.transpose();
    if (known + variance > 0) update_by<kDim, 1>(f.x, f.P, H, Vector<1>(by), Matrix<1, 1>(variance), Loss{});
    if (variance == 0) f.x += H.transpose() * (std::clamp(double(H * f.x), low, high) - H * f.x);  // rounding
  };
  const double low = limits_.min_surge, high = limits_.max_surge;
  if (pair.course) {
    hold(*pair.course, Matrix<1, kDim>::Unit(4), low, high, limits_.surge_sigma);
    hold(*pair.course, Matrix<1, kDim>::Unit(5), -limits_.max_yaw_rate, limits_.max_yaw_rate, limits_.yaw_rate_sigma);
  }
  const double speed = pair.drift.x.segment<2>(3).norm();
  if (!(speed > 0)) return;
  Matrix<1, kDim> along = Matrix<1, kDim>::Zero();
  along.segment<2>(3) = pair.drift.x.segment<2>(3).transpose() / speed;
  hold(pair.drift, along, std::max({0.0, low, -high}), std::max(std::abs(low), std::abs(high)), limits_.surge_sigma);
}

void MotionHypotheses::update(Pair& pair, const TargetFix& fix) const {
  const auto by = [&]<int N>(Filter& f, const Matrix<N, kDim>& H, const Vector<N>& e, const Matrix<N, N>& R) {
    f.log_weight += update_by<kDim, N>(f.x, f.P, H, e, R, fix.loss);
  };
  const Matrix<3, 3> covariance = pair.scale.fixes * pair.scale.fixes * fix.covariance;
  const auto by_position = [&](Filter& f) {
    Matrix<3, kDim> H = Matrix<3, kDim>::Zero();
    H.leftCols<3>().setIdentity();
    by.template operator()<3>(f, H, fix.position - f.x.head<3>(), covariance);
  };
  if (fix.heading) {  // no sway: the drift velocity has the direction of the heading
    Filter& f = pair.drift;
    const Vector<2> along(std::cos(*fix.heading), std::sin(*fix.heading));
    Matrix<1, kDim> H = Matrix<1, kDim>::Zero();
    H.segment<2>(3) << -along.y(), along.x();
    const double slip = fix.heading_sigma * along.dot(f.x.segment<2>(3));
    by.template operator()<1>(f, H, -H * f.x, Matrix<1, 1>(kSwaySigma * kSwaySigma + slip * slip));
  }
  by_position(pair.drift);
  if (!pair.course) return;
  Filter& f = *pair.course;
  if (fix.heading) {
    Matrix<1, kDim> H = Matrix<1, kDim>::Zero();
    H[3] = 1;
    by.template operator()<1>(f, H, Vector<1>(wrapped_angle(*fix.heading - f.x[3])),
                              Matrix<1, 1>(fix.heading_sigma * fix.heading_sigma));
  }
  by_position(f);
}

/// Begins a course from the drift hypothesis if there is none, or if it has failed, and if the drift hypothesis clearly
/// moves.
void MotionHypotheses::begin_course(Pair& pair) const {
  const Filter& drift = pair.drift;
  if (pair.course && pair.course->log_weight > drift.log_weight - kCourseFailed) return;
  pair.course.reset();
  const Vector<2> velocity = drift.x.segment<2>(3);
  const double speed = velocity.norm();
  const Vector<2> along = velocity / std::max(speed, 1e-9), across(-along.y(), along.x());
  const double deviation = std::sqrt(across.dot(drift.P.block<2, 2>(3, 3) * across));
  if (!(speed > kMovingThreshold * deviation)) return;
  Matrix<kDim, kDim> J = Matrix<kDim, kDim>::Zero();
  J.topLeftCorner<3, 3>().setIdentity();
  J.bottomRightCorner<2, 2>().setIdentity();
  J.block<1, 2>(3, 3) = across.transpose() / speed;
  J.block<1, 2>(4, 3) = along.transpose();
  Filter course;
  course.x << drift.x.head<3>(), std::atan2(velocity.y(), velocity.x()), speed, 0, drift.x.tail<2>();
  course.P = J * drift.P * J.transpose();
  // Three stationary standard deviations of the yaw rate.
  const double turn =
      std::min(kMaxYawRateSigma, 3 * pair.scale.motion * noise_.yaw_rate * std::sqrt(0.5 * noise_.yaw_time));
  course.P(3, 3) += kCourseSigma * kCourseSigma;
  course.P(5, 5) = turn * turn;
  course.log_weight = drift.log_weight - kNewCoursePenalty;
  pair.course = course;
}

/// Updates all filters and their weights with a fix. Weights within a pair are updated with forgetting, weights of
/// noise scales without.
void MotionHypotheses::apply(State& state, const TargetFix& fix) const {
  double best = -HUGE_VAL;
  for (Pair& pair : state) {
    pair.drift.log_weight *= kForgettingFactor;
    if (pair.course) pair.course->log_weight *= kForgettingFactor;
    const double before = pair.log_weight();
    update(pair, fix);
    if (const double gain = pair.log_weight() - before; std::isfinite(gain)) {
      pair.log_evidence += gain;
    } else {  // numerical overflow: restart this pair
      pair = begin(fix, pair.scale);
      pair.log_evidence = -kMaxDisadvantage;
    }
    best = std::max(best, pair.log_evidence);
    const double max_weight = std::max(pair.drift.log_weight, pair.course ? pair.course->log_weight : -HUGE_VAL);
    pair.drift.log_weight -= max_weight;
    if (pair.course) pair.course->log_weight -= max_weight;
    begin_course(pair);
    apply_limits(pair);
  }
  for (Pair& pair : state) pair.log_evidence = std::max(pair.log_evidence - best, -kMaxDisadvantage);
}

/// Recomputes the states from index `from` on.
void MotionHypotheses::run(std::size_t from) {
  for (std::size_t i = from; i < history_.size(); ++i) {
    Instant& now = history_[i];
    State state = i > 0 ? history_[i - 1].after : start(now.fixes.front());
    if (i > 0)
      for (Pair& pair : state) move(pair, now.t - history_[i - 1].t);
    for (std::size_t k = i > 0 ? 0 : 1; k < now.fixes.size(); ++k) apply(state, now.fixes[k]);
    now.after = state;
    now.last_fix = now.fixes.empty() ? history_[i - 1].last_fix : now.t;
  }
}

void MotionHypotheses::add(double t, const std::optional<TargetFix>& fix) {
  if (!started() && !fix) return;
  if (started() && t < history_.front().t - kSameTime) return;
  auto at = std::lower_bound(history_.begin(), history_.end(), t - kSameTime,
                             [](const Instant& i, double x) { return i.t < x; });
  if (at == history_.end() || at->t > t + kSameTime) at = history_.insert(at, Instant{t, {}, {}});
  const auto from = std::size_t(at - history_.begin());
  // The first stored state summarises all earlier ones. A fix at its time updates it.
  if (from == 0 && truncated_) {
    if (!fix) return;
    apply(at->after, *fix);
    at->last_fix = at->t;
    return run(1);
  }
  if (fix) at->fixes.push_back(*fix);
  run(from);
}

void MotionHypotheses::forget_before(double t) {
  while (history_.size() > 1 && history_[1].t < t) {
    history_.pop_front();
    truncated_ = true;
  }
}

/// Calls f(x) for each number x of a checkpoint, in order. f may read or write it.
template <class F>
void MotionHypotheses::for_each_number(Instant& instant, F f) {
  const auto each_of = [&](Filter& filter) {
    for (double& x : filter.x) f(x);
    for (int i = 0; i < kDim; ++i)
      for (int j = 0; j <= i; ++j) {
        f(filter.P(j, i));
        filter.P(i, j) = filter.P(j, i);
      }
    f(filter.log_weight);
  };
  f(instant.last_fix);
  for (Pair& pair : instant.after) {
    f(pair.log_evidence);
    each_of(pair.drift);
    double has_course = pair.course.has_value();
    f(has_course);
    if (has_course == 0) continue;
    Filter course = pair.course.value_or(Filter());
    each_of(course);
    pair.course = course;
  }
}

MotionHypotheses::Checkpoint MotionHypotheses::checkpoint() const {
  Instant oldest = history_.front();
  Checkpoint checkpoint{oldest.t, {}};
  for_each_number(oldest, [&](double x) { checkpoint.numbers.push_back(x); });
  return checkpoint;
}

void MotionHypotheses::restore(const Checkpoint& checkpoint) {
  const auto throw_if = [](bool wrong) {
    if (wrong) throw BadInputError("motion hypotheses: the checkpoint is invalid or of another version");
  };
  auto next = checkpoint.numbers.begin();
  Instant oldest{checkpoint.t, {}, start({})};
  throw_if(!std::isfinite(checkpoint.t));
  for_each_number(oldest, [&](double& x) {
    throw_if(next == checkpoint.numbers.end() || !std::isfinite(*next));
    x = *next++;
  });
  double best = -kMaxDisadvantage, least = 0;
  for (const Pair& pair : oldest.after) {
    best = std::max(best, pair.log_evidence);
    least = std::min(least, pair.drift.P.diagonal().minCoeff());
    if (pair.course) least = std::min(least, pair.course->P.diagonal().minCoeff());
  }
  throw_if(best != 0 || least < 0 || next != checkpoint.numbers.end());
  while (started() && history_.front().t <= checkpoint.t + kSameTime) history_.pop_front();
  history_.push_front(std::move(oldest));
  truncated_ = true;
  run(1);
}

TargetMoments MotionHypotheses::at(double t) const {
  struct Component {
    double weight;
    Vector<3> position, velocity;
    Matrix<3, 3> covariance;
    double heading;
  };
  std::vector<Component> mixture;
  bool has_course = false;
  const double trust = std::exp((history_.back().last_fix - t) / kGapTime);
  for (Pair pair : history_.back().after) {
    const double weight = std::exp(pair.log_evidence * trust);
    if (weight < kNegligibleWeight) continue;
    move(pair, t - newest());
    const double both = pair.log_weight();
    const Filter& drift = pair.drift;
    const Vector<3> v(drift.x[3], drift.x[4], drift.x.tail<2>().dot(drift.x.segment<2>(3)));
    mixture.push_back({weight * std::exp(drift.log_weight - both), drift.x.head<3>(), v, drift.P.topLeftCorner<3, 3>(),
                       std::atan2(v.y(), v.x())});
    if (!pair.course) continue;
    has_course = true;
    const Filter& course = *pair.course;
    const Vector<2> forward(std::cos(course.x[3]), std::sin(course.x[3]));
    mixture.push_back({weight * std::exp(course.log_weight - both), course.x.head<3>(),
                       course.x[4] * Vector<3>(forward.x(), forward.y(), course.x.tail<2>().dot(forward)),
                       course.P.topLeftCorner<3, 3>(), course.x[3]});
  }
  double sum = 0;
  for (const Component& c : mixture) sum += c.weight;
  TargetMoments m{Vector<3>::Zero(), Matrix<3, 3>::Zero(), Vector<3>::Zero(), {}};
  const Component* likeliest = &mixture.front();
  for (Component& c : mixture) {
    c.weight /= sum;
    m.position += c.weight * c.position;
    m.velocity += c.weight * c.velocity;
    if (c.weight > likeliest->weight) likeliest = &c;
  }
  for (const Component& c : mixture) {
    const Vector<3> offset = c.position - m.position;
    m.covariance += c.weight * (c.covariance + offset * offset.transpose());
  }
  if (has_course) m.heading = likeliest->heading;
  return m;
}

}  // namespace tandem
