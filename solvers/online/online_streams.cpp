#include <algorithm>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/solvers/online/online_streams.hpp>

namespace tandem {
namespace {

using detail::NextStep;
using detail::OnlineEvent;
using detail::seconds_text;
using MaybeRejection = std::optional<Rejection>;
using Kind = Rejection::Kind;

constexpr double kCoarse = 5.0;      // duration of the coarse alignment [s]
constexpr double kLagMemory = 60.0;  // time constant after which a shorter lag of the IMU is believed [s]
constexpr double kLagMargin = 1.5;   // multiple of the IMU's lag for which its samples are awaited
constexpr int kTargetSubject = -1;   // HealthMonitor subject of target sensors

TrackingData without_measurements(TrackingData data) {
  for (TargetSensor& sensor : data.sensors) sensor.measurements.clear();
  data.odometry.clear();
  return data;
}

std::optional<NavigationData> without_measurements(std::optional<NavigationData> data) {
  if (!data) return data;
  for (EgoSensor& sensor : data->sensors) sensor.measurements.clear();
  if (data->imu) data->imu->samples.clear();
  return data;
}

std::vector<detail::HealthMonitor::Sensor> monitored_sensors(const TrackingData& tracking, const NavigationData* ego) {
  std::vector<detail::HealthMonitor::Sensor> sensors;
  const auto bit = [](EgoReading reading) { return 1u << int(reading); };
  // A DVL and a GPS receiver confirm each other, and depth and heading. Depth and heading do not confirm other sensors.
  // Without an IMU, a DVL does not confirm a heading either, because it moves along with it.
  const unsigned gps = bit(EgoReading::world_vector), motion = bit(EgoReading::body_vector) | gps;
  if (ego)
    for (const EgoSensor& sensor : ego->sensors) {
      const bool only_gps = !ego->imu && sensor.type->reading == EgoReading::orientation;
      sensors.push_back({sensor.name, int(sensor.type->reading), only_gps ? gps : motion,
                         sensor.type->reading != EgoReading::body_vector});
    }
  for (const TargetSensor& sensor : tracking.sensors) sensors.push_back({sensor.name, kTargetSubject});
  return sensors;
}

}  // namespace

OnlineEstimator::Streams::Streams(OnlineEstimator& hooks, const TrackingData& tracking,
                                  const std::optional<NavigationData>& ego, const OnlineOptions& options)
    : hooks_(hooks),
      options_(options),
      settings_(without_measurements(tracking)),
      ego_(without_measurements(ego)),
      alignment_data_(ego_.value_or(NavigationData())),
      start_(options.start),
      interval_(ego_ && settings_.sensors.empty() ? ego_->keyframe_interval : settings_.keyframe_interval),
      queue_(options.lag.window),
      health_(monitored_sensors(settings_, ego_ ? &*ego_ : nullptr), options.reset) {
  make_window();
  make_screens();
}

void OnlineEstimator::Streams::make_screens() {
  odometry_screen_ = {};
  imu_screen_.reset();
  screens_.clear();
  newest_ego_.clear();
  if (ego_) {
    if (ego_->imu) {
      imu_screen_.emplace(*ego_->imu);
      imu_trial_.emplace(*ego_, options_);
    }
    for (const EgoSensor& sensor : ego_->sensors) screens_.emplace_back(screen_options(sensor));
    newest_ego_.resize(ego_->sensors.size());
  }
  for (const TargetSensor& sensor : settings_.sensors) screens_.emplace_back(screen_options(sensor));
}

MaybeRejection OnlineEstimator::Streams::add_imu(const ImuSample& sample) {
  if (!ego_ || !ego_->imu) return Rejection{Kind::not_in_use, "imu: not in use"};
  const std::string& name = ego_->imu->name;
  if (!(sample.t > last_imu_))
    return Rejection{Kind::not_increasing,
                     name + ": the sample at " + seconds_text(sample.t) + " is not later than the previous one"};
  if (auto why = queue_.why_invalid_stamp(name, sample.t, window_->started()))
    return Rejection{Kind::invalid_time, *why};
  learn_imu_lag(sample.t);
  ImuSample judged = sample;
  if (const auto fault = imu_screen_->judge(judged)) {
    process_until(sample.t);  // time advances although the value is rejected
    return Rejection{Kind::implausible,
                     name + ": rejected a sample at " + seconds_text(sample.t) + " " + std::string(text(*fault)),
                     sample.t};
  }
  last_imu_ = sample.t;
  imu_trial_->add(judged);
  if (imu_excluded_) {
    process_until(sample.t);  // time advances although the value is rejected
    readmit_imu(sample.t);
    return Rejection{
        Kind::implausible,
        name + ": rejected a sample at " + seconds_text(sample.t) + ", which contradicts the other sensors", sample.t};
  }
  if (window_->has_chain())
    window_->add(judged);
  else
    alignment_data_.imu->samples.push_back(judged);
  return process_until(sample.t);
}

MaybeRejection OnlineEstimator::Streams::add_ego(std::size_t sensor, const EgoMeasurement& m) {
  if (!ego_ || sensor >= ego_->sensors.size())
    return Rejection{Kind::not_in_use, "the chaser has no sensor with this index"};
  const EgoSensor& by = ego_->sensors[sensor];
  if (auto why = queue_.why_invalid_stamp(by.name, m.t, window_->started())) return Rejection{Kind::invalid_time, *why};
  if (auto why = why_implausible(sensor, by.name, m.t, reading(by.type, m))) return why;
  newest_ego_[sensor] = m;
  health_.received(sensor, by.valid_at(m));
  if (auto late = why_too_late(by.name, by.valid_at(m))) return late;
  if (!window_->has_chain()) alignment_data_.sensors[sensor].measurements.push_back(m);
  return enqueue(m.t, by.valid_at(m), {sensor, m});
}

MaybeRejection OnlineEstimator::Streams::add_target(std::size_t sensor, const Measurement& m) {
  if (sensor >= settings_.sensors.size()) return Rejection{Kind::not_in_use, "no sensor of the target has this index"};
  const TargetSensor& by = settings_.sensors[sensor];
  if (auto why = queue_.why_invalid_stamp(by.name, m.t, window_->started())) return Rejection{Kind::invalid_time, *why};
  if (auto why = why_implausible(target_index(sensor), by.name, m.t, reading(by.type, m))) return why;
  health_.received(target_index(sensor), by.valid_at(m));
  if (auto late = why_too_late(by.name, by.valid_at(m))) return late;
  return enqueue(m.t, by.valid_at(m), {sensor, m});
}

/// Judges a value. Time advances even if the value is rejected.
MaybeRejection OnlineEstimator::Streams::why_implausible(std::size_t index, const std::string& name, double t,
                                                         const Reading& reading) {
  const auto fault = screens_[index].judge(t, reading);
  if (!fault) return {};
  process_until(t);
  return Rejection{Kind::implausible,
                   name + ": rejected a line at " + seconds_text(t) + " " + std::string(text(*fault)), t};
}

MaybeRejection OnlineEstimator::Streams::enqueue(double stamp, double valid, OnlineEvent event) {
  queue_.push(valid, std::move(event));
  return process_until(stamp);
}

/// Advances the clock and processes the queue. Returns the reason if a measurement was rejected, possibly an earlier
/// one.
MaybeRejection OnlineEstimator::Streams::process_until(double stamp) {
  queue_.advance(stamp);
  process();
  drop_stale();
  update_output_health();
  return std::exchange(rejected_, {});
}

void OnlineEstimator::Streams::finish() {
  finished_ = true;
  process();
  if (!due_ && !pending_) return;
  if (!due_) due_ = Clock::now();
  update();
}

MaybeRejection OnlineEstimator::Streams::why_too_late(const std::string& name, double t) const {
  if (!window_->started() || t >= window_->first() - kSameInstant) return {};
  return Rejection{Kind::too_late, name + ": the measurement valid at " + seconds_text(t) +
                                       " is older than the window, which begins at " + seconds_text(window_->first())};
}

/// Returns the end of the known motion of the chaser [s].
double OnlineEstimator::Streams::motion_end() const {
  if (finished_) return HUGE_VAL;
  if (!ego_) return odometry_.empty() ? -HUGE_VAL : odometry_.back().t;
  if (!uses_imu()) return queue_.clock();
  return queue_.clock() - last_imu_ > imu_wait() ? queue_.clock() : last_imu_;
}

/// Records how far the clock is ahead of a new sample. Samples may arrive late or in packets.
void OnlineEstimator::Streams::learn_imu_lag(double t) {
  const double clock = queue_.clock();
  if (!std::isfinite(clock)) return;
  imu_lag_ = std::max(imu_lag_ * std::exp(-std::max(0.0, clock - imu_lag_at_) / kLagMemory), clock - t);
  imu_lag_at_ = clock;
}

/// Returns the time for which the next IMU sample is awaited before the chaser coasts [s].
double OnlineEstimator::Streams::imu_wait() const {
  return std::max(ego_->imu->max_gap, std::min(kLagMargin * imu_lag_, options_.lag.window));
}

/// Returns the latest time of a keyframe without measurements [s].
double OnlineEstimator::Streams::keyframe_limit() const {
  return std::min(motion_end(), ego_ ? queue_.clock() : odometry_.empty() ? -HUGE_VAL : odometry_.back().t);
}

NextStep OnlineEstimator::Streams::next() const {
  return next_step({.newest = window_->started() ? window_->newest() : -HUGE_VAL,
                    .interval = interval_,
                    .motion_end = motion_end(),
                    .keyframe_limit = keyframe_limit(),
                    .expects_target = !settings_.sensors.empty(),
                    .attaches_to_earlier = ego_ && ego_->imu,
                    .finished = finished_},
                   queue_.next());
}

void OnlineEstimator::Streams::process() {
  for (;;) {
    if (ego_ && !window_->has_chain() && !start_chaser()) return;
    const NextStep step = next();
    if (step == NextStep::wait) return;
    if (suspend_before(step == NextStep::event ? queue_.next()->t : window_->newest() + interval_)) continue;
    const Clock::time_point begin = Clock::now();
    bool needs_update = true;
    if (step == NextStep::event) {
      needs_update = process_event();
    } else {
      add_keyframe(window_->newest() + interval_);
    }
    if (ego_ && !window_->has_chain()) continue;
    if (needs_update && !due_) due_ = begin;
    // Simultaneous events share one update.
    const bool more = next() == NextStep::event && queue_.next()->t <= window_->newest() + kSameInstant;
    if (due_ && !more) update();
  }
}

/// Initialises the chaser when there is enough data for the alignment. Returns whether it was initialised.
bool OnlineEstimator::Streams::start_chaser() {
  const double patience = ego_->imu ? imu_wait() : 0;
  const bool known = start_ && queue_.clock() > start_->t + patience;  // no measurement is needed for the start
  const double first = start_time(alignment_data_).value_or(known ? start_->t : HUGE_VAL);
  if (!std::isfinite(first)) return false;
  Alignment alignment;
  if (start_) {
    alignment = *start_;
    if (keyframe_limit() < alignment.t) return false;
    start_.reset();
  } else {
    if (!finished_ && queue_.clock() - first < kCoarse) return false;
    alignment = coarse_alignment(alignment_data_);
    if (alignment.heading_unknown) {
      if (!finished_ && queue_.clock() - first < options_.alignment) return false;
      alignment = align(alignment_data_, options_.alignment, options_);
    }
  }
  static const std::vector<ImuSample> none;
  window_->start_chaser(alignment, alignment_data_.imu ? alignment_data_.imu->samples : none);
  aligned_ = alignment.t;
  alignment_data_ = {};
  queue_.drop_before(alignment.t - kSameInstant);
  return true;
}

/// Processes the next event. Returns whether an update is needed.
bool OnlineEstimator::Streams::process_event() {
  const auto [t, event] = queue_.take();
  if (const auto* m = std::get_if<EgoMeasurement>(&event.measurement)) return process_ego(event.sensor, *m, t);
  return process_target(event.sensor, std::get<Measurement>(event.measurement), t);
}

/// Attaches a measurement of the chaser to an existing keyframe, or to a new one if the IMU samples do not reach its
/// time.
bool OnlineEstimator::Streams::process_ego(std::size_t sensor, const EgoMeasurement& m, double t) {
  const bool own = !window_->can_attach(t);
  if (own && t <= window_->newest()) {
    reject(ego_->sensors[sensor].name, t);
    return false;
  }
  if (own) add_keyframe(t);
  if (imu_trial_) imu_trial_->add(sensor, m);
  const auto outcome = window_->attach(sensor, m, t);
  if (!apply_gate(sensor, ego_->sensors[sensor].name, t, outcome)) {
    if (t >= next_imu_trial_ && exclude_imu(health_.all_contradicting_since(t), t)) return false;
    if (!health_.must_reset_to(sensor)) return own;
    if (exclude_imu(health_.contradicting_since(sensor), t)) return false;
    health_.adopt(sensor);
    reset_to(ego_->sensors[sensor].name, t, ego_->sensors[sensor].type);
    return window_->has_chain() && process_ego(sensor, m, t);  // without a chain, the chaser is aligned again
  }
  pending_ = true;
  return own;
}

/// Adds a measurement of the target, at a new keyframe unless it is late.
bool OnlineEstimator::Streams::process_target(std::size_t sensor, const Measurement& m, double t) {
  const TargetSensor& by = settings_.sensors[sensor];
  const bool here = window_->started() && std::abs(t - window_->newest()) <= kSameInstant;
  const bool late = window_->started() && !here && t < window_->newest();
  const bool first = !window_->has_target();
  if (first && (!by.position_in_chaser(m) || late || (!ego_ && !pose_at(odometry_, t)))) {
    reject(by.name, t);
    return false;
  }
  const bool own = !here && !late;
  if (own) {
    add_keyframe(t, sensor, &m);
  } else if (first) {
    window_->start_target(sensor, m);
  }
  const auto outcome = window_->add_measurement(sensor, m);
  if (outcome.why_not) {
    reject(by.name, {t < window_->first() ? Kind::too_late : Kind::unusable, *outcome.why_not});
    return own || first;
  }
  if (apply_gate(target_index(sensor), by.name, t, outcome)) return true;
  if (!health_.must_reset_to(target_index(sensor))) return own || first;
  health_.adopt(target_index(sensor));
  reset_to(by.name, t);
  return by.position_in_chaser(m) && process_target(sensor, m, t);
}

/// Records the outcome of the gate for sensor `index` of the health monitor. Returns whether the measurement passed.
bool OnlineEstimator::Streams::apply_gate(std::size_t index, const std::string& name, double t,
                                          const detail::OnlineWindow::Outcome& outcome) {
  if (!outcome.rejected) {
    const auto shift = health_.used(index, t, outcome.innovation);
    if (shift && hooks_.on_shift) hooks_.on_shift(index, *shift, health_.other_agreeing_sensors(index, t));
    return true;
  }
  health_.rejected(index, t, *outcome.innovation.sigmas);
  const std::string others = health_.other_agreeing_sensors(index, t);
  reject(name, {Kind::outside_gate,
                name + ": the measurement valid at " + seconds_text(t) + " is outside the gate, " +
                    std::to_string(*outcome.innovation.sigmas) + " standard deviations from its prediction" +
                    (others.empty() ? "" : ", in contradiction to " + others),
                t, *outcome.innovation.sigmas});
  return false;
}

void OnlineEstimator::Streams::reject(const std::string& name, double t) {
  std::string why = name + ": cannot use the measurement valid at " + seconds_text(t);
  const bool of_target = std::any_of(settings_.sensors.begin(), settings_.sensors.end(),
                                     [&](const TargetSensor& s) { return s.name == name; });
  if (of_target && !window_->has_target())
    why += "; a position measurement is needed to initialise the target, within the chaser's known motion";
  reject(name, {Kind::unusable, std::move(why)});
}

/// Reports a rejection to the hook, or stores it for the return value of the current call.
void OnlineEstimator::Streams::reject(const std::string& name, const Rejection& why) {
  if (hooks_.on_reject)
    hooks_.on_reject(name, why);
  else
    rejected_ = why;
}

void OnlineEstimator::Streams::add_keyframe(double t, std::size_t sensor, const Measurement* first) {
  SE3 dead_reckoned;
  if (!ego_) dead_reckoned = pose_at(odometry_, t).value_or(odometry_.back().value);
  window_->add_keyframe(t, dead_reckoned, sensor, first);
  new_keyframe_ = true;
}

void OnlineEstimator::Streams::update() {
  const Clock::time_point begin = *std::exchange(due_, {});
  Summary summary;
  try {
    summary = window_->update();
  } catch (const UndefinedResidualError& error) {
    return reset_window(TrackReset::Kind::unconverged, std::string("the window cannot be updated: ") + error.what());
  }
  pending_ = false;
  health_.updated(window_->newest(), summary.converged());
  update_output_health();
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  const bool new_keyframe = std::exchange(new_keyframe_, false);
  if (hooks_.on_update) hooks_.on_update({window_->newest(), window_->newest_type(), new_keyframe, seconds, summary});
  if (summary.status == Status::infeasible && options_.soften_infeasible) {
    soften_constraints();
  } else if (health_.is_stuck(window_->newest())) {
    reset_window(TrackReset::Kind::unconverged,
                 "the window has not converged since " + seconds_text(health_.health().unconverged_since.value()),
                 {.position = Vector<3>::Constant(10),
                  .rotation = Vector<3>(0.3, 0.3, 0.5),
                  .velocity = Vector<3>::Constant(3)});
  }
}

void OnlineEstimator::Streams::soften_constraints() {
  TrackingOptions& target = options_.tracking;
  for (Role* role : {&target.roll_pitch, &target.non_holonomic, &target.limits})
    if (*role == Role::hard) *role = Role::soft;
  reset_window(TrackReset::Kind::unconverged, "no motion of the target satisfies the hard constraints at " +
                                                  seconds_text(window_->newest()) + ", so they are soft from now on");
}

}  // namespace tandem
