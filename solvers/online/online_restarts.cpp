#include <algorithm>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/online_streams.hpp>
#include <tandem/solvers/online/plausible.hpp>

// How an estimate ends and begins anew.
namespace tandem {
namespace {

using detail::EventQueue;
using detail::seconds_text;

constexpr double kSure = 1e-6;      // m, rad, m/s: nothing is surer, or a start would be held for exact
constexpr double kSureBias = 1e-9;  // m/s², rad/s

}  // namespace

void OnlineEstimator::Streams::make_window() {
  window_ = std::make_unique<detail::OnlineWindow>(settings_, ego_ ? &*ego_ : nullptr, options_);
  window_->on_leave = [this](const Stamped<EgoState>& state) {
    if (hooks_.on_leave) hooks_.on_leave(state);
  };
}

/// Gives the window up as a whole. A chaser that moves by its own sensors goes on from its newest state, as sure of it as
/// it was but for `doubt`, or aligns anew.
void OnlineEstimator::Streams::restart(TrackReset::Kind kind, std::string why, const EgoSpread& doubt, Chaser chaser) {
  const double t = window_->newest();
  if (hooks_.on_reset) hooks_.on_reset({kind, t, std::move(why)});
  health_.restarted(kind);
  due_.reset();
  new_keyframe_ = unsolved_ = false;
  if (!window_->has_chain()) return make_window();
  Alignment start{.t = t, .state = window_->chaser(), .spread = newest_spread(doubt).value_or(doubt)};
  start.spread.bias.reset();  // what is given up may have bent them
  const bool goes_on = chaser == Chaser::goes_on && detail::is_plausible(start.state.pose) &&
                       start.state.velocity.allFinite() && start.state.bias.allFinite();
  std::vector<Stamped<EgoState>> states = window_->states();
  if (goes_on) states.pop_back();
  if (hooks_.on_leave)
    for (const Stamped<EgoState>& state : states) hooks_.on_leave(state);
  make_window();
  if (goes_on) {
    window_->start_chaser(start, {recent_samples_.begin(), recent_samples_.end()});
  } else {
    waiting_ = *ego_;
  }
}

void OnlineEstimator::Streams::begin_anew() {
  if (window_->started()) restart(TrackReset::Kind::begun_anew, "time begins anew", {}, Chaser::aligns);
  health_.forget_times();
  queue_ = EventQueue(options_.lag.window);
  if (ego_) waiting_ = *ego_;
  odometry_.clear();
  jumped_.clear();
  recent_samples_.clear();
  last_imu_ = aligned_ = -HUGE_VAL;
  note_outputs();
}

/// Along world axes, of the chaser's newest state, no less than this; empty when the last update had no covariance.
std::optional<EgoSpread> OnlineEstimator::Streams::newest_spread(const EgoSpread& least) const try {
  const OnlineEstimator::Covariance c = window_->covariance();
  const Matrix<3, 3> R = window_->chaser().pose.rotation().matrix();
  const auto sigma = [](const Matrix<3, 3>& S, const Vector<3>& floor) {
    return Vector<3>(S.diagonal().cwiseMax(0).cwiseSqrt().cwiseMax(floor));
  };
  EgoSpread spread{sigma(R * c.chaser.topLeftCorner<3, 3>() * R.transpose(), least.position),
                   sigma(R * c.chaser.bottomRightCorner<3, 3>() * R.transpose(), least.rotation),
                   sigma(c.velocity, least.velocity)};
  if (c.bias.size() > 0) spread.bias = c.bias.diagonal().cwiseMax(kSureBias * kSureBias).cwiseSqrt();
  return spread;
} catch (const Error&) {
  return {};
}

std::optional<Alignment> OnlineEstimator::Streams::newest_start() const {
  if (!window_->has_chain()) return {};
  const Vector<3> sure = Vector<3>::Constant(kSure);
  const auto spread = newest_spread({sure, sure, sure});
  if (!spread) return {};
  return Alignment{.t = window_->newest(), .state = window_->chaser(), .spread = *spread};
}

/// Whatever came last, also where no update follows: what ages is what is given out.
void OnlineEstimator::Streams::note_outputs() {
  const std::size_t own = watched_target(0);
  std::optional<double> target;
  if (window_->has_target()) target = health_.last_used(own, own + settings_.sensors.size());
  health_.at(queue_.clock(), chaser_aided(), target);
}

/// By what keeps its place or velocity from drifting [s]; nothing without a chaser.
std::optional<double> OnlineEstimator::Streams::chaser_aided() const {
  if (!window_->started()) return {};
  if (!ego_) return odometry_.back().t;
  double t = aligned_;
  for (std::size_t i = 0; i < ego_->sensors.size(); ++i) {
    const EgoReading reading = ego_->sensors[i].type->reading;
    if (reading == EgoReading::body_vector || reading == EgoReading::world_vector)
      t = std::max(t, health_.last_used(i, i + 1));
  }
  return t;
}

/// Before a step at t: whether the estimate is suspended because nothing has been measured for too long.
bool OnlineEstimator::Streams::suspend_before(double t) {
  if (!window_->started()) return false;
  const double gap = options_.reset.max_gap;
  const std::size_t own = watched_target(0);
  const bool target_lost = window_->has_target() && t - health_.last_used(own, own + settings_.sensors.size()) > gap;
  const bool chaser_lost = ego_ && t - std::max({last_imu_, health_.last_used(0, own), aligned_}) > gap;
  if (!target_lost && !chaser_lost) return false;
  restart(TrackReset::Kind::suspended,
          (chaser_lost ? "the chaser's own sensors have" : "what observes the target has") +
              std::string(" told nothing for ") + std::to_string(std::lround(gap)) + " s at " +
              seconds_text(window_->newest()),
          {}, chaser_lost ? Chaser::aligns : Chaser::goes_on);
  return true;
}

/// What waits for a chaser's motion that does not come, or for a start, does not wait for ever.
void OnlineEstimator::Streams::forget_old() {
  const double patience = start_ ? HUGE_VAL : std::max(options_.reset.max_gap, 2 * options_.alignment);
  const double limit = queue_.clock() - patience;
  if (!std::isfinite(limit) || reached() >= limit) {
    if (!std::isfinite(limit) || window_->started()) return;
  } else if (window_->started()) {
    restart(TrackReset::Kind::suspended, "the chaser's motion is not known since " + seconds_text(reached()), {},
            Chaser::aligns);
  }
  queue_.drop_before(limit);
  if (waiting_.imu) std::erase_if(waiting_.imu->samples, [&](const ImuSample& x) { return x.t < limit; });
  for (EgoSensor& sensor : waiting_.sensors)
    std::erase_if(sensor.measurements, [&](const EgoMeasurement& m) { return m.t < limit; });
}

}  // namespace tandem
