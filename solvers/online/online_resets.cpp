#include <algorithm>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/online_streams.hpp>

// Resets of the estimate, and the health of its outputs.
namespace tandem {
namespace {

using detail::EventQueue;
using detail::seconds_text;

// Smallest standard deviations of a start state; zero would mean that it is exact.
constexpr double kMinSigma = 1e-6;                    // m, rad, m/s
constexpr double kMinBiasSigma = 1e-9;                // m/s², rad/s
constexpr double kRecent = 5;                         // s; age up to which a measurement tells the state after a reset
constexpr double kMaxDistance = 1e8, kMaxSpeed = 30;  // m, m/s; a state beyond them is wrong

bool is_plausible(const EgoState& state) {
  const Vector<3>& p = state.pose.translation();
  return p.allFinite() && p.cwiseAbs().maxCoeff() <= kMaxDistance && state.velocity.allFinite() &&
         state.bias.allFinite() && state.pose.rotation().quaternion().coeffs().allFinite();
}

}  // namespace

void OnlineEstimator::Streams::make_window() {
  window_ = std::make_unique<detail::OnlineWindow>(settings_, ego_ ? &*ego_ : nullptr, options_);
  window_->on_leave = [this](const Stamped<EgoState>& state) {
    if (hooks_.on_leave) hooks_.on_leave(state);
  };
}

/// Discards the window. A chaser with its own sensors continues from its newest state, with standard deviations of at
/// least `min_sigmas`, or is aligned again.
void OnlineEstimator::Streams::reset_window(TrackReset::Kind kind, std::string why, const EgoStateSigmas& min_sigmas,
                                            Chaser chaser) {
  const double t = window_->newest();
  if (hooks_.on_reset) hooks_.on_reset({kind, t, std::move(why)});
  health_.record_reset(kind);
  due_.reset();
  new_keyframe_ = pending_ = false;
  if (!window_->has_chain()) return make_window();
  Alignment start{.t = t, .state = window_->chaser(), .sigmas = newest_state_sigmas(min_sigmas).value_or(min_sigmas)};
  start.sigmas.bias.reset();  // the discarded estimate may have distorted the biases
  const bool continues = chaser == Chaser::continues && is_plausible(start.state);
  if (continues && kind != TrackReset::Kind::suspended) adopt_measured(start);
  std::vector<Stamped<EgoState>> states = window_->states();
  if (continues) states.pop_back();
  if (hooks_.on_leave)
    for (const Stamped<EgoState>& state : states) hooks_.on_leave(state);
  make_window();
  if (continues) {
    window_->start_chaser(start, {recent_samples_.begin(), recent_samples_.end()});
  } else {
    alignment_data_ = *ego_;
  }
}

/// Sets the velocity and the height to their newest measurements, and the position if its standard deviation is large.
/// A wrong velocity makes the position uncertain, too.
void OnlineEstimator::Streams::adopt_measured(Alignment& start) const {
  EgoState& state = start.state;
  const SO3& R = state.pose.rotation();
  Vector<3> p = state.pose.translation();
  const auto newest = [&](EgoReading reading) -> std::pair<const EgoSensor*, const EgoMeasurement*> {
    for (std::size_t i = 0; i < newest_ego_.size(); ++i) {
      const EgoSensor& sensor = ego_->sensors[i];
      if (sensor.type->reading == reading && newest_ego_[i] &&
          std::abs(sensor.valid_at(*newest_ego_[i]) - start.t) <= kRecent)
        return {&sensor, &*newest_ego_[i]};
    }
    return {};
  };
  Vector<3> velocity = state.velocity;
  if (const auto [dvl, m] = newest(EgoReading::body_vector); m)
    velocity = R.act(m->value);
  else if (velocity.norm() > kMaxSpeed)
    velocity.setZero();
  const double wrong = (velocity - state.velocity).norm(), since = options_.reset.reset_after;
  start.sigmas.position.array() += std::min(wrong, kMaxSpeed) * (std::isfinite(since) ? since : kRecent);
  state.velocity = velocity;
  if (const auto [gps, m] = newest(EgoReading::world_vector); m) {
    const Vector<3> measured = m->value - R.act(gps->mount.translation());
    for (int i = 0; i < 3; ++i)
      if (std::abs(measured[i] - p[i]) < start.sigmas.position[i]) p[i] = measured[i];
  }
  if (const auto [depth, m] = newest(EgoReading::world_height); m) {
    const double z = m->value.z() - R.act(depth->mount.translation()).z();
    start.sigmas.position.z() = std::max(start.sigmas.position.z(), std::abs(z - p.z()));
    p.z() = z;
  }
  state.pose = SE3(R, p);
}

void OnlineEstimator::Streams::reset() {
  reset_requested_ = true;
  if (changing_) return;
  changing_ = true;
  const struct End {
    Streams& streams;
    ~End() { streams.changing_ = streams.reset_requested_ = false; }
  } end{*this};
  reset_now();
}

void OnlineEstimator::Streams::reset_now() {
  if (window_->started()) reset_window(TrackReset::Kind::time_reset, "the time base was reset", {}, Chaser::realigns);
  health_.forget_times();
  queue_ = EventQueue(options_.lag.window);
  if (ego_) alignment_data_ = *ego_;
  odometry_.clear();
  make_screens();
  recent_samples_.clear();
  last_imu_ = aligned_ = -HUGE_VAL;
  update_output_health();
}

/// Returns the standard deviations of the chaser's newest state along world axes, at least `min_sigmas`. Empty without
/// a covariance.
std::optional<EgoStateSigmas> OnlineEstimator::Streams::newest_state_sigmas(const EgoStateSigmas& min_sigmas) const
    try {
  const OnlineEstimator::Covariance c = window_->covariance();
  const Matrix<3, 3> R = window_->chaser().pose.rotation().matrix();
  const auto sigma = [](const Matrix<3, 3>& S, const Vector<3>& floor) {
    return Vector<3>(S.diagonal().cwiseMax(0).cwiseSqrt().cwiseMax(floor));
  };
  EgoStateSigmas sigmas{sigma(R * c.chaser.topLeftCorner<3, 3>() * R.transpose(), min_sigmas.position),
                        sigma(R * c.chaser.bottomRightCorner<3, 3>() * R.transpose(), min_sigmas.rotation),
                        sigma(c.velocity, min_sigmas.velocity)};
  if (c.bias.size() > 0) sigmas.bias = c.bias.diagonal().cwiseMax(kMinBiasSigma * kMinBiasSigma).cwiseSqrt();
  return sigmas;
} catch (const NumericalError&) {
  return {};
}

std::optional<Alignment> OnlineEstimator::Streams::handover_start() const {
  if (!window_->has_chain()) return {};
  const Vector<3> floor = Vector<3>::Constant(kMinSigma);
  const auto sigmas = newest_state_sigmas({floor, floor, floor});
  if (!sigmas) return {};
  return Alignment{.t = window_->newest(), .state = window_->chaser(), .sigmas = *sigmas};
}

/// Updates the health of the outputs. Called after each measurement, since outputs also age without updates.
void OnlineEstimator::Streams::update_output_health() {
  const std::size_t own = target_index(0);
  std::optional<double> target;
  if (window_->has_target()) target = health_.last_used(own, own + settings_.sensors.size());
  health_.update_outputs(queue_.clock(), chaser_aided(), target);
}

/// Returns the time of the last measurement that limits the drift of the chaser's position or velocity [s]. Empty if
/// the chaser is not initialised.
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

/// Suspends the estimate before a step to time t if measurements are missing for too long. Returns whether it did.
bool OnlineEstimator::Streams::suspend_before(double t) {
  if (!window_->started()) return false;
  const double gap = options_.reset.max_gap;
  const std::size_t own = target_index(0);
  const bool target_lost = window_->has_target() && t - health_.last_used(own, own + settings_.sensors.size()) > gap;
  const bool chaser_lost = ego_ && t - std::max({last_imu_, health_.last_used(0, own), aligned_}) > gap;
  if (!target_lost && !chaser_lost) return false;
  reset_window(TrackReset::Kind::suspended,
               std::string("no measurement of the ") + (chaser_lost ? "chaser" : "target") + " for " +
                   std::to_string(std::lround(gap)) + " s at " + seconds_text(window_->newest()),
               {}, chaser_lost ? Chaser::realigns : Chaser::continues);
  return true;
}

/// Drops data that has waited too long for the chaser's motion or its alignment.
void OnlineEstimator::Streams::drop_stale() {
  const double patience = start_ ? HUGE_VAL : std::max(options_.reset.max_gap, 2 * options_.alignment);
  const double limit = queue_.clock() - patience;
  if (!std::isfinite(limit) || motion_end() >= limit) {
    if (!std::isfinite(limit) || window_->started()) return;
  } else if (window_->started()) {
    reset_window(TrackReset::Kind::suspended, "the chaser's motion is unknown since " + seconds_text(motion_end()), {},
                 Chaser::realigns);
  }
  queue_.drop_before(limit);
  if (alignment_data_.imu) std::erase_if(alignment_data_.imu->samples, [&](const ImuSample& x) { return x.t < limit; });
  for (EgoSensor& sensor : alignment_data_.sensors)
    std::erase_if(sensor.measurements, [&](const EgoMeasurement& m) { return m.t < limit; });
}

}  // namespace tandem
