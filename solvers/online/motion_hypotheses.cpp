#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/ornstein_uhlenbeck.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>

namespace tandem {
namespace {

constexpr double kSameTime = 1e-3;      // s
constexpr double kStep = 1.0;           // s: of a course that turns, at most
constexpr double kFirstSpeed = 5.0;     // m/s: deviation of the velocity at the first fix
constexpr double kFirstSlope = 0.01;    // deviation of the frame's slopes then
constexpr double kMemory = 0.85;        // of a hypothesis's likelihood, from one fix to the next
constexpr double kMostAgainst = 30;     // in log-likelihood, what is held against a guess, which may be right one day
constexpr double kCounts = 1e-4;        // share of a pair below which its prediction is not worth its time
constexpr double kFailed = 20;          // log-likelihood ratio at which a course is given up
constexpr double kHandicap = 3;         // in log-likelihood, of a course that has just begun
constexpr double kUnderWay = 2.5;       // speed against its deviation across, from which on there is a course
constexpr double kCourseSpread = 0.05;  // rad: of the heading about the direction of travel
constexpr double kLargestTurn = 0.1;    // rad/s: deviation of the yaw rate where a course begins
constexpr double kSway = 0.05;          // m/s
constexpr double kLeastWeight = 1e-6;   // of a fix that a loss leaves nothing of
constexpr double kOutlier = 12;         // squared deviations beyond those expected, from which on a fix tells nothing
constexpr double kSilence = 100;        // s: after which, without a fix, what was found of the noise tells little
constexpr double kMostSteps = 1000;     // of one move

/// A Kalman update by the rows H x = z, whose innovation is e and whose noise R a loss makes larger; returns the
/// log-likelihood but for a constant, by R as it is: made larger it would reward whoever calls a fix an outlier. One that
/// a loss weighs counts for no more than an outlier.
template <int D, int N>
double update_by(Vector<D>& x, Matrix<D, D>& P, const Matrix<N, D>& H, const Vector<N>& e, const Matrix<N, N>& R,
                 const Loss& loss) {
  const Matrix<D, N> PH = P * H.transpose();
  const Matrix<N, N> S = H * PH + R;
  Matrix<N, N> inverse = S.inverse();
  const double squares = e.dot(inverse * e), weight = std::max(loss(squares).d1, kLeastWeight);
  if (weight != 1) inverse = (S + (1 / weight - 1) * R).inverse();
  const Matrix<D, N> K = PH * inverse;
  x += K * e;
  const Matrix<D, D> left = Matrix<D, D>::Identity() - K * H;  // Joseph's form: stays positive after long silence
  P = (left * P * left.transpose() + K * (R / weight) * K.transpose()).eval();
  P = (0.5 * (P + P.transpose())).eval();
  return -0.5 * ((weight != 1 ? std::min(squares, kOutlier + N) : squares) + std::log(S.determinant()));
}

/// log(exp(a) + exp(b))
double log_sum(double a, double b) { return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b))); }

double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

}  // namespace

double MotionHypotheses::Pair::log_weight() const {
  return course ? log_sum(drift.log_weight, course->log_weight) : drift.log_weight;
}

MotionHypotheses::Pair MotionHypotheses::begin(const TargetFix& fix, const NoiseGuess& guess) {
  Filter drift;
  drift.x.setZero();
  drift.x.head<3>() = fix.position;
  drift.P.setZero();
  drift.P.topLeftCorner<3, 3>() = fix.covariance;
  drift.P.diagonal().segment<2>(3).setConstant(kFirstSpeed * kFirstSpeed);
  drift.P.diagonal().tail<2>().setConstant(kFirstSlope * kFirstSlope);
  return {.guess = guess, .drift = drift, .course = {}};
}

MotionHypotheses::State MotionHypotheses::start(const TargetFix& fix) {
  State state;
  for (std::size_t i = 0; i < state.size(); ++i) state[i] = begin(fix, kGuesses[i]);
  return state;
}

/// Steps are taken as short against what is forgotten: noise gathers as if nothing were within one. A drifting point is
/// never calmer than the noise says: it is what is left where a course fails.
void MotionHypotheses::move_drift(Filter& f, double motion, double dt) const {
  const OrnsteinUhlenbeck velocity{noise_.drift_time};
  const double gone = -noise_.drift_time * std::expm1(-dt / noise_.drift_time);  // by a velocity of 1
  const auto v = f.x.segment<2>(3), slope = f.x.tail<2>();
  Matrix<kDim, kDim> F = Matrix<kDim, kDim>::Identity();
  F(0, 3) = F(1, 4) = gone;
  F.block<1, 2>(2, 3) = gone * slope.transpose();
  F.block<1, 2>(2, 6) = gone * v.transpose();
  F(3, 3) = F(4, 4) = velocity.kept(dt);
  f.x.head<3>() += (gone * Vector<3>(v.x(), v.y(), slope.dot(v))).eval();
  f.x.segment<2>(3) *= F(3, 3);
  f.P = (F * f.P * F.transpose()).eval();
  const double root = std::max(motion, 1.0) * noise_.drift, q = root * root;
  Matrix<3, 2> plane;  // its x and y
  plane << 1, 0, 0, 1, slope.x(), slope.y();
  Matrix<5, 5> Q;
  Q << q * dt * dt * dt / 3 * plane * plane.transpose(), q * dt * dt / 2 * plane,  //
      q * dt * dt / 2 * plane.transpose(), q * dt * Matrix<2, 2>::Identity();
  f.P.topLeftCorner<5, 5>() += Q;
}

void MotionHypotheses::move_course(Filter& f, double motion, double dt) const {
  const double turned = -noise_.yaw_time * std::expm1(-dt / noise_.yaw_time);  // by a yaw rate of 1
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
  F(5, 5) = OrnsteinUhlenbeck{noise_.yaw_time}.kept(dt);
  f.P = (F * f.P * F.transpose()).eval();
  f.x.head<3>() += way * along;
  f.x[3] += turned * f.x[5];
  f.x[5] *= F(5, 5);
  // White noise on the speed and once integrated along; on the yaw rate, integrated to the heading, and to the way across.
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
  const double longest = std::max(kStep, dt / kMostSteps);
  for (double left = dt; left > 0; left -= longest) {
    const double step = std::min(left, longest);
    move_drift(pair.drift, pair.guess.motion, step);
    wander(pair.drift, step);
    if (!pair.course) continue;
    move_course(*pair.course, pair.guess.motion, step);
    wander(*pair.course, step);
  }
}

void MotionHypotheses::update(Pair& pair, const TargetFix& fix) const {
  const auto by = [&]<int N>(Filter& f, const Matrix<N, kDim>& H, const Vector<N>& e, const Matrix<N, N>& R) {
    f.log_weight += update_by<kDim, N>(f.x, f.P, H, e, R, fix.loss);
  };
  const Matrix<3, 3> covariance = pair.guess.fixes * pair.guess.fixes * fix.covariance;
  const auto by_position = [&](Filter& f) {
    Matrix<3, kDim> H = Matrix<3, kDim>::Zero();
    H.leftCols<3>().setIdentity();
    by.template operator()<3>(f, H, fix.position - f.x.head<3>(), covariance);
  };
  if (fix.heading) {  // no sway: the drifting point goes where the target faces
    Filter& f = pair.drift;
    const Vector<2> along(std::cos(*fix.heading), std::sin(*fix.heading));
    Matrix<1, kDim> H = Matrix<1, kDim>::Zero();
    H.segment<2>(3) << -along.y(), along.x();
    const double slip = fix.heading_sigma * along.dot(f.x.segment<2>(3));
    by.template operator()<1>(f, H, -H * f.x, Matrix<1, 1>(kSway * kSway + slip * slip));
  }
  by_position(pair.drift);
  if (!pair.course) return;
  Filter& f = *pair.course;
  if (fix.heading) {
    Matrix<1, kDim> H = Matrix<1, kDim>::Zero();
    H[3] = 1;
    by.template operator()<1>(f, H, Vector<1>(wrapped(*fix.heading - f.x[3])),
                              Matrix<1, 1>(fix.heading_sigma * fix.heading_sigma));
  }
  by_position(f);
}

/// Begins a course where there is none, or where the fixes have told against it, and the drifting point is under way.
void MotionHypotheses::set_out(Pair& pair) const {
  const Filter& drift = pair.drift;
  if (pair.course && pair.course->log_weight > drift.log_weight - kFailed) return;
  pair.course.reset();
  const Vector<2> velocity = drift.x.segment<2>(3);
  const double speed = velocity.norm();
  const Vector<2> along = velocity / std::max(speed, 1e-9), across(-along.y(), along.x());
  const double deviation = std::sqrt(across.dot(drift.P.block<2, 2>(3, 3) * across));
  if (!(speed > kUnderWay * deviation)) return;
  Matrix<kDim, kDim> J = Matrix<kDim, kDim>::Zero();
  J.topLeftCorner<3, 3>().setIdentity();
  J.bottomRightCorner<2, 2>().setIdentity();
  J.block<1, 2>(3, 3) = across.transpose() / speed;
  J.block<1, 2>(4, 3) = along.transpose();
  Filter course;
  course.x << drift.x.head<3>(), std::atan2(velocity.y(), velocity.x()), speed, 0, drift.x.tail<2>();
  course.P = J * drift.P * J.transpose();
  // Three deviations that it has in the long run.
  const double turn =
      std::min(kLargestTurn, 3 * pair.guess.motion * noise_.yaw_rate * std::sqrt(0.5 * noise_.yaw_time));
  course.P(3, 3) += kCourseSpread * kCourseSpread;
  course.P(5, 5) = turn * turn;
  course.log_weight = drift.log_weight - kHandicap;
  pair.course = course;
}

/// A fix by all, weighed: within a pair the past fades, between guesses it counts as a whole.
void MotionHypotheses::take(State& state, const TargetFix& fix) const {
  double best = -HUGE_VAL;
  for (Pair& pair : state) {
    pair.drift.log_weight *= kMemory;
    if (pair.course) pair.course->log_weight *= kMemory;
    const double before = pair.log_weight();
    update(pair, fix);
    if (const double gain = pair.log_weight() - before; std::isfinite(gain)) {
      pair.log_evidence += gain;
    } else {  // too far for its numbers: begins again
      pair = begin(fix, pair.guess);
      pair.log_evidence = -kMostAgainst;
    }
    best = std::max(best, pair.log_evidence);
    const double most = std::max(pair.drift.log_weight, pair.course ? pair.course->log_weight : -HUGE_VAL);
    pair.drift.log_weight -= most;
    if (pair.course) pair.course->log_weight -= most;
    set_out(pair);
  }
  for (Pair& pair : state) pair.log_evidence = std::max(pair.log_evidence - best, -kMostAgainst);
}

/// The states from `from` on, out of the one before.
void MotionHypotheses::run(std::size_t from) {
  for (std::size_t i = from; i < history_.size(); ++i) {
    Instant& now = history_[i];
    State state = i > 0 ? history_[i - 1].after : start(now.fixes.front());
    if (i > 0)
      for (Pair& pair : state) move(pair, now.t - history_[i - 1].t);
    for (std::size_t k = i > 0 ? 0 : 1; k < now.fixes.size(); ++k) take(state, now.fixes[k]);
    now.after = state;
    now.seen = now.fixes.empty() ? history_[i - 1].seen : now.t;
  }
}

void MotionHypotheses::add(double t, const std::optional<TargetFix>& fix) {
  if (!started() && !fix) return;
  if (started() && t < history_.front().t - kSameTime) return;
  auto at = std::lower_bound(history_.begin(), history_.end(), t - kSameTime,
                             [](const Instant& i, double x) { return i.t < x; });
  if (at == history_.end() || at->t > t + kSameTime) at = history_.insert(at, Instant{t, {}, {}});
  const auto from = std::size_t(at - history_.begin());
  // The first instant kept stands for all before it: a fix there is one more on top of its state.
  if (from == 0 && forgotten_) {
    if (!fix) return;
    take(at->after, *fix);
    at->seen = at->t;
    return run(1);
  }
  if (fix) at->fixes.push_back(*fix);
  run(from);
}

void MotionHypotheses::forget_before(double t) {
  while (history_.size() > 1 && history_[1].t < t) {
    history_.pop_front();
    forgotten_ = true;
  }
}

/// f(number) of each that a memory has, in its order; what f leaves there is then the instant's.
template <class F>
void MotionHypotheses::each_number(Instant& instant, F f) {
  const auto each_of = [&](Filter& filter) {
    for (double& x : filter.x) f(x);
    for (int i = 0; i < kDim; ++i)
      for (int j = 0; j <= i; ++j) {
        f(filter.P(j, i));
        filter.P(i, j) = filter.P(j, i);
      }
    f(filter.log_weight);
  };
  f(instant.seen);
  for (Pair& pair : instant.after) {
    f(pair.log_evidence);
    each_of(pair.drift);
    double under_way = pair.course.has_value();
    f(under_way);
    if (under_way == 0) continue;
    Filter course = pair.course.value_or(Filter());
    each_of(course);
    pair.course = course;
  }
}

MotionHypotheses::Memory MotionHypotheses::memory() const {
  Instant oldest = history_.front();
  Memory memory{oldest.t, {}};
  each_number(oldest, [&](double x) { memory.numbers.push_back(x); });
  return memory;
}

void MotionHypotheses::go_on_from(const Memory& memory) {
  const auto refuse = [](bool wrong) {
    if (wrong) throw Error("motion hypotheses cannot go on from these numbers: they are no memory of this version");
  };
  auto next = memory.numbers.begin();
  Instant oldest{memory.t, {}, start({})};
  refuse(!std::isfinite(memory.t));
  each_number(oldest, [&](double& x) {
    refuse(next == memory.numbers.end() || !std::isfinite(*next));
    x = *next++;
  });
  double best = -kMostAgainst, least = 0;
  for (const Pair& pair : oldest.after) {
    best = std::max(best, pair.log_evidence);
    least = std::min(least, pair.drift.P.diagonal().minCoeff());
    if (pair.course) least = std::min(least, pair.course->P.diagonal().minCoeff());
  }
  refuse(best != 0 || least < 0 || next != memory.numbers.end());
  while (started() && history_.front().t <= memory.t + kSameTime) history_.pop_front();
  history_.push_front(std::move(oldest));
  forgotten_ = true;
  run(1);
}

TargetMoments MotionHypotheses::at(double t) const {
  struct Guess {
    double share;
    Vector<3> position, velocity;
    Matrix<3, 3> covariance;
    double heading;
  };
  std::vector<Guess> guesses;
  bool under_way = false;
  const double trusted = std::exp((history_.back().seen - t) / kSilence);
  for (Pair pair : history_.back().after) {
    const double share = std::exp(pair.log_evidence * trusted);
    if (share < kCounts) continue;
    move(pair, t - newest());
    const double both = pair.log_weight();
    const Filter& drift = pair.drift;
    const Vector<3> v(drift.x[3], drift.x[4], drift.x.tail<2>().dot(drift.x.segment<2>(3)));
    guesses.push_back({share * std::exp(drift.log_weight - both), drift.x.head<3>(), v, drift.P.topLeftCorner<3, 3>(),
                       std::atan2(v.y(), v.x())});
    if (!pair.course) continue;
    under_way = true;
    const Filter& course = *pair.course;
    const Vector<2> forward(std::cos(course.x[3]), std::sin(course.x[3]));
    guesses.push_back({share * std::exp(course.log_weight - both), course.x.head<3>(),
                       course.x[4] * Vector<3>(forward.x(), forward.y(), course.x.tail<2>().dot(forward)),
                       course.P.topLeftCorner<3, 3>(), course.x[3]});
  }
  double sum = 0;
  for (const Guess& g : guesses) sum += g.share;
  TargetMoments m{Vector<3>::Zero(), Matrix<3, 3>::Zero(), Vector<3>::Zero(), {}};
  const Guess* likeliest = &guesses.front();
  for (Guess& g : guesses) {
    g.share /= sum;
    m.position += g.share * g.position;
    m.velocity += g.share * g.velocity;
    if (g.share > likeliest->share) likeliest = &g;
  }
  for (const Guess& g : guesses) {
    const Vector<3> apart = g.position - m.position;
    m.covariance += g.share * (g.covariance + apart * apart.transpose());
  }
  if (under_way) m.heading = likeliest->heading;
  return m;
}

}  // namespace tandem
