#include <algorithm>
#include <cmath>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/online_streams.hpp>

// Resets of the estimate, and the health of its outputs.
namespace tandem {
namespace {

using detail::EventQueue;
using detail::seconds_text;

// Smallest standard deviations of a start state; zero would mean that it is exact.
constexpr double kMinSigma = 1e-6;      // m, rad, m/s
constexpr double kMinBiasSigma = 1e-9;  // m/s², rad/s
constexpr double kRecent = 5;           // s; maximum age of a measurement that sets the state after a reset
constexpr double kMaxDistance = 1e8, kMaxSpeed = 30;  // m, m/s; a state beyond them is wrong

constexpr double kWrongHeading = 3;       // rad, standard deviation
constexpr double kWindowWithoutImu = 10;  // s; without IMU samples, each measurement makes a keyframe

/// Returns whether a sensor limits the drift of position or velocity.
bool limits_drift(const EgoSensor& sensor) {
  const EgoReading reading = sensor.type->reading;
  return reading == EgoReading::body_vector || reading == EgoReading::world_vector;
}

bool is_plausible(const EgoState& state) {
  const Vector<3>& p = state.pose.translation();
  return p.allFinite() && p.cwiseAbs().maxCoeff() <= kMaxDistance && state.velocity.allFinite() &&
         state.bias.allFinite() && state.pose.rotation().quaternion().coeffs().allFinite();
}

/// Returns the standard deviations of a chaser's state after a sensor of this type has found it to be wrong.
EgoStateSigmas sigmas_without_sensor(EgoSensorType type) {
  EgoStateSigmas spread;
  switch (type->reading) {
    case EgoReading::body_vector:
      spread.velocity.setConstant(10);
      break;
    case EgoReading::world_vector:
      spread.position.setConstant(1e3);
      break;
    case EgoReading::world_height:
      spread.position.z() = 1e3;
      break;
    case EgoReading::orientation:
      spread.rotation.z() = kWrongHeading;
      break;
  }
  return spread;
}

}  // namespace

void OnlineEstimator::Streams::make_window() {
  OnlineOptions options = options_;
  if (imu_excluded_) options.lag.window = std::min(options.lag.window, kWindowWithoutImu);
  window_ = std::make_unique<detail::OnlineWindow>(settings_, ego_ ? &*ego_ : nullptr, options);
  window_->on_leave = [this](const Stamped<EgoState>& state) {
    if (hooks_.on_leave) hooks_.on_leave(state);
  };
}

/// Reports a reset, and discards what belongs to the old estimate except for the window.
void OnlineEstimator::Streams::begin_reset(TrackReset::Kind kind, std::string why) {
  if (hooks_.on_reset) hooks_.on_reset({kind, window_->newest(), std::move(why)});
  health_.record_reset(kind);
  due_.reset();
  new_keyframe_ = pending_ = false;
}

/// Discards the window. A chaser with its own sensors continues from its newest state, with standard deviations of at
/// least `min_sigmas`, or is aligned again.
void OnlineEstimator::Streams::reset_window(TrackReset::Kind kind, std::string why, const EgoStateSigmas& min_sigmas,
                                            Chaser chaser) {
  begin_reset(kind, std::move(why));
  if (!window_->has_chain()) return make_window();
  Alignment start{.t = window_->newest(),
                  .state = window_->chaser(),
                  .sigmas = state_sigmas(window_->own_keyframe(HUGE_VAL), min_sigmas).value_or(min_sigmas)};
  start.sigmas.bias.reset();  // the discarded estimate may have distorted the biases
  const bool continues = chaser == Chaser::continues && is_plausible(start.state);
  if (continues && kind != TrackReset::Kind::suspended) adopt_measured(start);
  std::vector<Stamped<EgoState>> states = window_->states();
  if (continues) states.pop_back();
  if (hooks_.on_leave)
    for (const Stamped<EgoState>& state : states) hooks_.on_leave(state);
  make_window();
  if (continues) {
    window_->start_chaser(start, newest_samples());
  } else {
    end_imu_exclusion(queue_.clock());
    alignment_data_ = *ego_;
  }
}

/// Resets the estimate after a sensor contradicted it until time `t`. `own` is the type of a sensor of the chaser.
void OnlineEstimator::Streams::reset_to(const std::string& sensor, double t, std::optional<EgoSensorType> own) {
  reset_window(TrackReset::Kind::contradicted,
               sensor + " contradicts the estimate: it was rejected until " + seconds_text(t),
               own ? sigmas_without_sensor(*own) : EgoStateSigmas());
}

/// Sets the velocity, the height and the position to their newest measurements, and a heading that was wrong. A wrong
/// velocity makes the position uncertain, too; so does a wrong heading since the alignment.
void OnlineEstimator::Streams::adopt_measured(Alignment& start) const {
  EgoState& state = start.state;
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
  SO3 R = state.pose.rotation();
  Vector<3> velocity = state.velocity;
  if (start.sigmas.rotation.z() >= kWrongHeading) {
    if (const auto [heading, m] = newest(EgoReading::orientation); m) {
      const Matrix<3, 3> E = (m->rotation * heading->mount.rotation().inverse() * R.inverse()).matrix();
      const SO3 turn = SO3::Exp({0, 0, std::atan2(E(1, 0) - E(0, 1), E(0, 0) + E(1, 1))});
      R = turn * R;
      velocity = turn.act(velocity);
    }
    const double wrong = 2 * std::min(velocity.norm(), kMaxSpeed);
    start.sigmas.velocity = start.sigmas.velocity.cwiseMax(wrong);
    if (std::isfinite(aligned_))
      start.sigmas.position.head<2>() = start.sigmas.position.head<2>().cwiseMax(wrong * (start.t - aligned_));
  }
  if (const auto [dvl, m] = newest(EgoReading::body_vector); m)
    velocity = R.act(m->value);
  else if (velocity.norm() > kMaxSpeed)
    velocity.setZero();
  const double wrong = (velocity - state.velocity).norm(), since = options_.reset.reset_after;
  start.sigmas.position.array() += std::min(wrong, kMaxSpeed) * (std::isfinite(since) ? since : kRecent);
  state.velocity = velocity;
  if (const auto [gps, m] = newest(EgoReading::world_vector); m) {
    const Vector<3> measured = m->value - R.act(gps->mount.translation());
    for (int i = 0; i < 3; ++i) {
      const double distance = std::abs(measured[i] - p[i]);
      if (distance >= start.sigmas.position[i] && distance <= options_.reset.gate * gps->sigma[i]) continue;
      start.sigmas.position[i] = std::max(start.sigmas.position[i], distance);
      p[i] = measured[i];
    }
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
  last_imu_ = aligned_ = -HUGE_VAL;
  update_output_health();
}

/// Returns the standard deviations of the chaser's state at a keyframe along world axes, at least `min_sigmas`. Empty
/// without a covariance.
std::optional<EgoStateSigmas> OnlineEstimator::Streams::state_sigmas(const EgoKeyframe& keyframe,
                                                                     const EgoStateSigmas& min_sigmas) const try {
  const OnlineEstimator::Covariance c = window_->own_covariance(keyframe);
  const Matrix<3, 3> R = window_->own_state(keyframe).pose.rotation().matrix();
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

std::optional<Alignment> OnlineEstimator::Streams::handover_start() const { return state_before(HUGE_VAL); }

/// Returns the state at the last keyframe of the chaser at or before t, or at the oldest one.
std::optional<Alignment> OnlineEstimator::Streams::state_before(double t) const {
  if (!window_->has_chain()) return {};
  const Vector<3> floor = Vector<3>::Constant(kMinSigma);
  const EgoKeyframe& keyframe = window_->own_keyframe(t);
  const auto sigmas = state_sigmas(keyframe, {floor, floor, floor});
  if (!sigmas) return {};
  return Alignment{.t = keyframe.t, .state = window_->own_state(keyframe), .sigmas = *sigmas};
}

/// Updates the health of the outputs. Called after each measurement, since outputs also age without updates.
void OnlineEstimator::Streams::update_output_health() {
  const std::size_t own = target_index(0);
  std::optional<double> target;
  if (window_->has_target()) target = health_.last_used(own, own + settings_.sensors.size());
  health_.update_outputs(queue_.clock(), chaser_aided(), target);
  std::size_t of_chaser = uses_imu() && window_->has_chain(), of_target = 0;
  for (std::size_t i = 0; i < own; ++i)
    of_chaser += limits_drift(ego_->sensors[i]) && health_.agrees(i, queue_.clock());
  for (std::size_t i = 0; i < settings_.sensors.size(); ++i) of_target += health_.agrees(own + i, queue_.clock());
  health_.set_confirmed(of_chaser > 1, of_target > 1);
}

/// Returns the time of the last measurement that limits the drift of the chaser's position or velocity [s]. Empty if
/// the chaser is not initialised.
std::optional<double> OnlineEstimator::Streams::chaser_aided() const {
  if (!window_->started()) return {};
  if (!ego_) return odometry_.back().t;
  double t = aligned_;
  for (std::size_t i = 0; i < ego_->sensors.size(); ++i) {
    if (limits_drift(ego_->sensors[i])) t = std::max(t, health_.last_used(i, i + 1));
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
