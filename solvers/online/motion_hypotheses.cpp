#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include <tandem/residuals/ornstein_uhlenbeck.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>

namespace tandem {
namespace {

constexpr double kSameTime = 1e-3;      // s
constexpr double kStep = 1.0;           // s: of a course that turns, at most
constexpr double kFirstSpeed = 5.0;     // m/s: deviation of the velocity at the first fix
constexpr double kMemory = 0.8;         // of a likelihood, from one fix to the next
constexpr double kFailed = 20;          // log-likelihood ratio at which a course is given up
constexpr double kHandicap = 3;         // in log-likelihood, of a course that has just begun
constexpr double kUnderWay = 2.5;       // speed against its deviation across, from which on there is a course
constexpr double kCourseSpread = 0.05;  // rad: of the heading about the direction of travel
constexpr double kLargestTurn = 0.1;    // rad/s: deviation of the yaw rate where a course begins
constexpr double kSway = 0.05;          // m/s
constexpr double kLeastWeight = 1e-6;   // of a fix that a loss leaves nothing of

/// A Kalman update by the rows H x = z, whose innovation is e; returns twice the negative log-likelihood but for a constant.
template <int N>
double update_by(Vector<6>& x, Matrix<6, 6>& P, const Matrix<N, 6>& H, const Vector<N>& e, const Matrix<N, N>& R) {
  const Matrix<6, N> PH = P * H.transpose();
  const Matrix<N, N> S = H * PH + R;
  const Matrix<N, N> inverse = S.inverse();
  const Matrix<6, N> K = PH * inverse;
  x += K * e;
  P -= (K * PH.transpose()).eval();
  P = (0.5 * (P + P.transpose())).eval();
  return e.dot(inverse * e) + std::log(S.determinant());
}

double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

}  // namespace

MotionHypotheses::State MotionHypotheses::start(const TargetFix& fix) const {
  State state{};
  state.drift.x << fix.position, Vector<3>::Zero();
  state.drift.P.setZero();
  state.drift.P.topLeftCorner<3, 3>() = fix.covariance;
  state.drift.P.diagonal().segment<2>(3).setConstant(kFirstSpeed * kFirstSpeed);
  return state;
}

/// Steps are taken as short against what is forgotten: noise gathers as if nothing were within one.
void MotionHypotheses::move_drift(Filter& f, double dt) const {
  const OrnsteinUhlenbeck velocity{noise_.drift_time};
  Matrix<6, 6> F = Matrix<6, 6>::Identity();
  F(0, 3) = F(1, 4) = -noise_.drift_time * std::expm1(-dt / noise_.drift_time);
  F(3, 3) = F(4, 4) = velocity.kept(dt);
  f.x = (F * f.x).eval();
  f.P = (F * f.P * F.transpose()).eval();
  const double q = noise_.drift * noise_.drift;
  for (const int i : {0, 1}) {
    f.P(i, i) += q * dt * dt * dt / 3;
    f.P(i, i + 3) += q * dt * dt / 2;
    f.P(i + 3, i) += q * dt * dt / 2;
    f.P(i + 3, i + 3) += q * dt;
  }
  f.P(2, 2) += noise_.climb * noise_.climb * dt;
}

void MotionHypotheses::move_course(Filter& f, double dt) const {
  const double turned = -noise_.yaw_time * std::expm1(-dt / noise_.yaw_time);  // by a yaw rate of 1
  const double middle = f.x[3] + 0.5 * turned * f.x[5], way = f.x[4] * dt;
  const Vector<2> along(std::cos(middle), std::sin(middle)), across(-along.y(), along.x());
  Matrix<6, 6> F = Matrix<6, 6>::Identity();
  F.block<2, 1>(0, 3) = way * across;
  F.block<2, 1>(0, 4) = dt * along;
  F.block<2, 1>(0, 5) = 0.5 * turned * way * across;
  F(3, 5) = turned;
  F(5, 5) = OrnsteinUhlenbeck{noise_.yaw_time}.kept(dt);
  f.P = (F * f.P * F.transpose()).eval();
  f.x.head<2>() += way * along;
  f.x[3] += turned * f.x[5];
  f.x[5] *= F(5, 5);
  // White noise on the speed and once integrated along; on the yaw rate, integrated to the heading, and to the way across.
  const double qs = noise_.surge * noise_.surge, qr = noise_.yaw_rate * noise_.yaw_rate;
  const double dt2 = dt * dt, dt3 = dt2 * dt;
  Matrix<6, 6> Q = Matrix<6, 6>::Zero();
  Q.topLeftCorner<2, 2>() =
      qs * dt3 / 3 * along * along.transpose() + qr * dt3 / 20 * way * way * across * across.transpose();
  Q.block<2, 1>(0, 4) = qs * dt2 / 2 * along;
  Q.block<2, 1>(0, 3) = qr * dt3 / 8 * way * across;
  Q.block<2, 1>(0, 5) = qr * dt2 / 6 * way * across;
  Q(3, 5) = qr * dt2 / 2;
  Q = Matrix<6, 6>(Q.selfadjointView<Eigen::Upper>());
  Q.diagonal().tail<3>() << qr * dt3 / 3, qs * dt, qr * dt;
  Q(2, 2) = noise_.climb * noise_.climb * dt;
  f.P += Q;
}

void MotionHypotheses::move(State& state, double dt) const {
  for (double left = dt; left > 0; left -= kStep) {
    move_drift(state.drift, std::min(left, kStep));
    if (state.course) move_course(*state.course, std::min(left, kStep));
  }
}

void MotionHypotheses::update(State& state, const TargetFix& fix) const {
  const auto take = [&]<int N>(Filter& f, const Matrix<N, 6>& H, const Vector<N>& e, const Matrix<N, N>& R) {
    const Matrix<N, N> S = H * f.P * H.transpose() + R;
    const double weight = std::max(fix.loss(e.dot(S.inverse() * e)).d1, kLeastWeight);  // what a loss leaves of it
    f.log_weight -= 0.5 * update_by<N>(f.x, f.P, H, e, R / weight);
  };
  const auto take_position = [&](Filter& f) {
    Matrix<3, 6> H = Matrix<3, 6>::Zero();
    H.leftCols<3>().setIdentity();
    take.template operator()<3>(f, H, fix.position - f.x.head<3>(), fix.covariance);
  };
  state.drift.log_weight *= kMemory;
  if (fix.heading) {  // no sway: the drifting point goes where the target faces
    Filter& f = state.drift;
    const Vector<2> along(std::cos(*fix.heading), std::sin(*fix.heading));
    Matrix<1, 6> H = Matrix<1, 6>::Zero();
    H.segment<2>(3) << -along.y(), along.x();
    const double slip = fix.heading_sigma * along.dot(f.x.segment<2>(3));
    take.template operator()<1>(f, H, -H * f.x, Matrix<1, 1>(kSway * kSway + slip * slip));
  }
  take_position(state.drift);
  if (!state.course) return;
  Filter& f = *state.course;
  f.log_weight *= kMemory;
  if (fix.heading) {
    Matrix<1, 6> H = Matrix<1, 6>::Zero();
    H[3] = 1;
    take.template operator()<1>(f, H, Vector<1>(wrapped(*fix.heading - f.x[3])),
                                Matrix<1, 1>(fix.heading_sigma * fix.heading_sigma));
  }
  take_position(f);
}

/// Begins a course where there is none, or where the fixes have told against it, and the drifting point is under way.
void MotionHypotheses::set_out(State& state) const {
  const Filter& drift = state.drift;
  if (state.course && state.course->log_weight > drift.log_weight - kFailed) return;
  state.course.reset();
  const Vector<2> velocity = drift.x.segment<2>(3);
  const double speed = velocity.norm();
  const Vector<2> along = velocity / std::max(speed, 1e-9), across(-along.y(), along.x());
  const double deviation = std::sqrt(across.dot(drift.P.block<2, 2>(3, 3) * across));
  if (!(speed > kUnderWay * deviation)) return;
  Matrix<6, 6> J = Matrix<6, 6>::Zero();
  J.topLeftCorner<3, 3>().setIdentity();
  J.block<1, 2>(3, 3) = across.transpose() / speed;
  J.block<1, 2>(4, 3) = along.transpose();
  Filter course;
  course.x << drift.x.head<3>(), std::atan2(velocity.y(), velocity.x()), speed, 0;
  course.P = J * drift.P * J.transpose();
  const double turn = std::min(kLargestTurn, 3 * noise_.yaw_rate * std::sqrt(0.5 * noise_.yaw_time));
  course.P(3, 3) += kCourseSpread * kCourseSpread;
  course.P(5, 5) = turn * turn;
  course.log_weight = drift.log_weight - kHandicap;
  state.course = course;
}

/// The states from `from` on, out of the one before.
void MotionHypotheses::run(std::size_t from) {
  for (std::size_t i = from; i < history_.size(); ++i) {
    Instant& now = history_[i];
    State state = i > 0 ? history_[i - 1].after : start(now.fixes.front());
    if (i > 0) move(state, now.t - history_[i - 1].t);
    for (std::size_t k = i > 0 ? 0 : 1; k < now.fixes.size(); ++k) {
      update(state, now.fixes[k]);
      set_out(state);
    }
    const double most = std::max(state.drift.log_weight, state.course ? state.course->log_weight : -HUGE_VAL);
    state.drift.log_weight -= most;
    if (state.course) state.course->log_weight -= most;
    now.after = state;
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
    update(at->after, *fix);
    set_out(at->after);
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

TargetMoments MotionHypotheses::at(double t) const {
  State state = history_.back().after;
  move(state, t - newest());
  const Filter& drift = state.drift;
  const double odds = state.course ? std::exp(state.course->log_weight - drift.log_weight) : 0;
  const double share = std::isfinite(odds) ? odds / (1 + odds) : 1;  // of the course
  TargetMoments m{drift.x.head<3>(), drift.P.topLeftCorner<3, 3>(), {drift.x[3], drift.x[4], 0}, {}};
  if (!state.course) return m;
  const Filter& course = *state.course;
  const Vector<3> ahead(course.x[4] * std::cos(course.x[3]), course.x[4] * std::sin(course.x[3]), 0);
  const Vector<3> apart = course.x.head<3>() - m.position;
  m.heading = course.x[3];
  if (share < 0.5) m.heading = std::atan2(m.velocity.y(), m.velocity.x());
  m.covariance = ((1 - share) * m.covariance + share * course.P.topLeftCorner<3, 3>() +
                  share * (1 - share) * apart * apart.transpose())
                     .eval();
  m.position += share * apart;
  m.velocity += (share * (ahead - m.velocity)).eval();
  return m;
}

}  // namespace tandem
