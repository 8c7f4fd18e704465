#include <algorithm>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/solvers/online/online_streams.hpp>
#include <tandem/solvers/online/plausible.hpp>

namespace tandem {
namespace {

using detail::NextStep;
using detail::OnlineEvent;
using detail::seconds_text;
using MaybeRefusal = std::optional<Refusal>;
using Kind = Refusal::Kind;

constexpr double kCoarse = 5.0;  // s that a coarse alignment looks at
constexpr std::size_t kMuchOdometry = 4096;
constexpr std::size_t kNewOrigin = 5;  // poses in a row that follow one another, but not the last one used
constexpr int kOfTarget = -1;          // subject of the sensors that observe it

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

std::string rejected_text(const std::string& name, double t) {
  return name + " has kept contradicting the estimate until " + seconds_text(t);
}

std::vector<detail::HealthMonitor::Sensor> watched(const TrackingData& tracking, const NavigationData* ego) {
  std::vector<detail::HealthMonitor::Sensor> sensors;
  if (ego)
    for (const EgoSensor& sensor : ego->sensors) sensors.push_back({sensor.name, int(sensor.type->reading)});
  for (const TargetSensor& sensor : tracking.sensors) sensors.push_back({sensor.name, kOfTarget});
  return sensors;
}

}  // namespace

OnlineEstimator::Streams::Streams(OnlineEstimator& hooks, const TrackingData& tracking,
                                  const std::optional<NavigationData>& ego, const OnlineOptions& options)
    : hooks_(hooks),
      options_(options),
      settings_(without_measurements(tracking)),
      ego_(without_measurements(ego)),
      waiting_(ego_.value_or(NavigationData())),
      start_(options.start),
      interval_(ego_ && settings_.sensors.empty() ? ego_->keyframe_interval : settings_.keyframe_interval),
      queue_(options.lag.window),
      health_(watched(settings_, ego_ ? &*ego_ : nullptr), options.reset) {
  make_window();
}

MaybeRefusal OnlineEstimator::Streams::add_odometry(const Stamped<SE3>& pose) {
  if (ego_) return Refusal{Kind::not_in_use, "odometry: the chaser moves by its own sensors here"};
  if (!odometry_.empty() && !(pose.t > odometry_.back().t))
    return Refusal{Kind::backwards,
                   "odometry: the pose at " + seconds_text(pose.t) + " is not later than the one before"};
  if (auto why = queue_.why_not_at("odometry", pose.t, window_->started())) return Refusal{Kind::not_a_time, *why};
  if (auto why = why_implausible("odometry", pose.t, detail::is_plausible(pose.value))) return why;
  if (!odometry_.empty() && !detail::follows(odometry_.back(), pose)) {
    if (!jumped_.empty() && !detail::follows(jumped_.back(), pose)) jumped_.clear();
    jumped_.push_back(pose);
    if (jumped_.size() < kNewOrigin)
      return Refusal{Kind::implausible, "odometry: the pose at " + seconds_text(pose.t) +
                                            " does not follow from the one before: no vehicle moves like that"};
    if (window_->started())
      restart(TrackReset::Kind::new_truth, "odometry goes on from elsewhere at " + seconds_text(jumped_.front().t));
    odometry_ = std::exchange(jumped_, {});
    return come(pose.t);
  }
  jumped_.clear();
  if (odometry_.size() > kMuchOdometry && window_->started())
    std::erase_if(odometry_, [&](const Stamped<SE3>& x) { return x.t < window_->newest() - 2 * interval_; });
  odometry_.push_back(pose);
  return come(pose.t);
}

MaybeRefusal OnlineEstimator::Streams::add_imu(const ImuSample& sample) {
  if (!ego_ || !ego_->imu) return Refusal{Kind::not_in_use, "imu: there is no such sensor here"};
  const std::string& name = ego_->imu->name;
  if (!(sample.t > last_imu_))
    return Refusal{Kind::backwards,
                   name + ": the sample at " + seconds_text(sample.t) + " is not later than the one before"};
  if (auto why = queue_.why_not_at(name, sample.t, window_->started())) return Refusal{Kind::not_a_time, *why};
  if (auto why = why_implausible(name, sample.t, detail::is_plausible(sample))) return why;
  last_imu_ = sample.t;
  if (window_->has_chain()) {
    recent_samples_.push_back(sample);
    while (recent_samples_.size() > 2 && recent_samples_[1].t < window_->newest()) recent_samples_.pop_front();
    window_->add(sample);
  } else {
    waiting_.imu->samples.push_back(sample);
  }
  return come(sample.t);
}

MaybeRefusal OnlineEstimator::Streams::add_ego(std::size_t sensor, const EgoMeasurement& m) {
  if (!ego_ || sensor >= ego_->sensors.size())
    return Refusal{Kind::not_in_use, "there is no such sensor of the chaser here"};
  const EgoSensor& by = ego_->sensors[sensor];
  if (auto why = queue_.why_not_at(by.name, m.t, window_->started())) return Refusal{Kind::not_a_time, *why};
  if (auto why = why_implausible(by.name, m.t, detail::is_plausible(by.type, m))) return why;
  health_.heard(sensor, by.valid_at(m));
  if (auto late = why_too_late(by.name, by.valid_at(m))) return late;
  if (!window_->has_chain()) waiting_.sensors[sensor].measurements.push_back(m);
  return wait(m.t, by.valid_at(m), {sensor, m});
}

MaybeRefusal OnlineEstimator::Streams::add_target(std::size_t sensor, const Measurement& m) {
  if (sensor >= settings_.sensors.size()) return Refusal{Kind::not_in_use, "there is no such sensor of a target here"};
  const TargetSensor& by = settings_.sensors[sensor];
  if (auto why = queue_.why_not_at(by.name, m.t, window_->started())) return Refusal{Kind::not_a_time, *why};
  if (auto why = why_implausible(by.name, m.t, detail::is_plausible(m))) return why;
  health_.heard(watched_target(sensor), by.valid_at(m));
  if (auto late = why_too_late(by.name, by.valid_at(m))) return late;
  return wait(m.t, by.valid_at(m), {sensor, m});
}

MaybeRefusal OnlineEstimator::Streams::why_implausible(const std::string& name, double t, bool plausible) const {
  if (plausible) return {};
  return Refusal{Kind::implausible, name + ": no such sensor reads what the line stamped " + seconds_text(t) + " says"};
}

MaybeRefusal OnlineEstimator::Streams::wait(double stamp, double valid, OnlineEvent event) {
  queue_.push(valid, std::move(event));
  return come(stamp);
}

/// A line stamped so has come. Returns why one was refused, also an earlier one whose turn it was.
MaybeRefusal OnlineEstimator::Streams::come(double stamp) {
  queue_.advance(stamp);
  process();
  forget_old();
  note_outputs();
  return std::exchange(refused_, {});
}

void OnlineEstimator::Streams::finish() {
  finished_ = true;
  process();
  if (!due_ && !unsolved_) return;
  if (!due_) due_ = Clock::now();
  update();
}

MaybeRefusal OnlineEstimator::Streams::why_too_late(const std::string& name, double t) const {
  if (!window_->started() || t >= window_->first() - kSameInstant) return {};
  return Refusal{Kind::too_late, name + ": the measurement valid at " + seconds_text(t) +
                                     " is older than the window, which begins at " + seconds_text(window_->first())};
}

/// How far the chaser's motion is known [s].
double OnlineEstimator::Streams::reached() const {
  if (finished_) return HUGE_VAL;
  if (!ego_) return odometry_.empty() ? -HUGE_VAL : odometry_.back().t;
  if (!ego_->imu) return queue_.clock();
  return queue_.clock() - last_imu_ > ego_->imu->max_gap ? queue_.clock() : last_imu_;
}

/// How far keyframes go where nothing is measured [s].
double OnlineEstimator::Streams::last_motion() const {
  return std::min(reached(), ego_ ? queue_.clock() : odometry_.empty() ? -HUGE_VAL : odometry_.back().t);
}

NextStep OnlineEstimator::Streams::next() const {
  return next_step({.newest = window_->started() ? window_->newest() : -HUGE_VAL,
                    .interval = interval_,
                    .reached = reached(),
                    .last_motion = last_motion(),
                    .target_may_come = !settings_.sensors.empty(),
                    .joins_earlier = ego_ && ego_->imu,
                    .finished = finished_},
                   queue_.next());
}

void OnlineEstimator::Streams::process() {
  for (;;) {
    if (ego_ && !window_->has_chain() && !start_chaser()) return;
    const NextStep step = next();
    if (step == NextStep::wait) return;
    if (suspend_before(step == NextStep::event ? queue_.next()->t : window_->newest() + interval_)) continue;
    const Clock::time_point begun = Clock::now();
    bool calls = true;
    if (step == NextStep::event) {
      calls = take_event();
    } else {
      add_keyframe(window_->newest() + interval_);
    }
    if (ego_ && !window_->has_chain()) continue;
    if (calls && !due_) due_ = begun;
    // Events of one instant share the solve.
    const bool more = next() == NextStep::event && queue_.next()->t <= window_->newest() + kSameInstant;
    if (due_ && !more) update();
  }
}

bool OnlineEstimator::Streams::start_chaser() {
  const double first = start_time(waiting_).value_or(HUGE_VAL);
  if (!std::isfinite(first)) return false;
  Alignment alignment;
  if (start_) {
    alignment = *start_;
    if (last_motion() < alignment.t) return false;
    start_.reset();
  } else {
    if (!finished_ && queue_.clock() - first < kCoarse) return false;
    alignment = coarse_alignment(waiting_);
    if (alignment.heading_unknown) {
      if (!finished_ && queue_.clock() - first < options_.alignment) return false;
      alignment = align(waiting_, options_.alignment, options_);
    }
  }
  static const std::vector<ImuSample> none;
  window_->start_chaser(alignment, waiting_.imu ? waiting_.imu->samples : none);
  if (waiting_.imu) recent_samples_.assign(waiting_.imu->samples.begin(), waiting_.imu->samples.end());
  aligned_ = alignment.t;
  waiting_ = {};
  queue_.drop_before(alignment.t - kSameInstant);
  return true;
}

/// Whether it calls for an update.
bool OnlineEstimator::Streams::take_event() {
  const auto [t, event] = queue_.take();
  if (const auto* m = std::get_if<EgoMeasurement>(&event.measurement)) return take_ego(event.sensor, *m, t);
  return take_target(event.sensor, std::get<Measurement>(event.measurement), t);
}

/// Joins a keyframe that is there; its own where the inertial samples do not reach.
bool OnlineEstimator::Streams::take_ego(std::size_t sensor, const EgoMeasurement& m, double t) {
  const bool own = !window_->reaches(t);
  if (own && t <= window_->newest()) {
    refuse(ego_->sensors[sensor].name, t);
    return false;
  }
  if (own) add_keyframe(t);
  const auto outcome = window_->attach(sensor, m, t);
  if (!judge(sensor, ego_->sensors[sensor].name, t, outcome)) {
    if (!health_.is_new_truth(sensor)) return own;
    restart(TrackReset::Kind::new_truth, rejected_text(ego_->sensors[sensor].name, t),
            detail::spread_without(ego_->sensors[sensor].type));
    return window_->has_chain() && take_ego(sensor, m, t);  // or else the chaser aligns anew, out of what comes
  }
  unsolved_ = true;
  return own;
}

/// At a keyframe of its own, but for a late one.
bool OnlineEstimator::Streams::take_target(std::size_t sensor, const Measurement& m, double t) {
  const TargetSensor& by = settings_.sensors[sensor];
  const bool here = window_->started() && std::abs(t - window_->newest()) <= kSameInstant;
  const bool late = window_->started() && !here && t < window_->newest();
  const bool first = !window_->has_target();
  if (first && (!by.position_in_chaser(m) || late || (!ego_ && !pose_at(odometry_, t)))) {
    refuse(by.name, t);
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
    refuse(by.name, {t < window_->first() ? Kind::too_late : Kind::of_no_use, *outcome.why_not});
    return own || first;
  }
  if (judge(watched_target(sensor), by.name, t, outcome)) return true;
  if (!health_.is_new_truth(watched_target(sensor))) return own || first;
  restart(TrackReset::Kind::new_truth, rejected_text(by.name, t));
  return by.position_in_chaser(m) && take_target(sensor, m, t);
}

/// Counts a measurement as used, or refuses it as rejected.
bool OnlineEstimator::Streams::judge(std::size_t watched, const std::string& name, double t,
                                     const detail::OnlineWindow::Outcome& outcome) {
  if (!outcome.rejected) {
    health_.used(watched, t, outcome.sigmas);
    return true;
  }
  health_.rejected(watched, t, *outcome.sigmas);
  refuse(name, {Kind::rejected, name + ": the measurement valid at " + seconds_text(t) + " is " +
                                    std::to_string(*outcome.sigmas) + " sigmas from what is expected"});
  return false;
}

void OnlineEstimator::Streams::refuse(const std::string& name, double t) {
  std::string why = name + ": nothing can be made of the measurement valid at " + seconds_text(t);
  if (!window_->has_target() && !settings_.sensors.empty())
    why += "; a target starts at a measurement of its position where the chaser's motion is known";
  refuse(name, {Kind::of_no_use, std::move(why)});
}

/// Told to the hook, where there is one: the line may be an earlier one than that which is just being added.
void OnlineEstimator::Streams::refuse(const std::string& name, const Refusal& why) {
  if (hooks_.on_refuse)
    hooks_.on_refuse(name, why);
  else
    refused_ = why;
}

void OnlineEstimator::Streams::add_keyframe(double t, std::size_t sensor, const Measurement* first) {
  SE3 dead_reckoned;
  if (!ego_) dead_reckoned = pose_at(odometry_, t).value_or(odometry_.back().value);
  window_->add_keyframe(t, dead_reckoned, sensor, first);
  new_keyframe_ = true;
}

void OnlineEstimator::Streams::update() {
  const Clock::time_point begun = *std::exchange(due_, {});
  const Summary summary = window_->update();
  unsolved_ = false;
  health_.updated(window_->newest(), summary.converged());
  note_outputs();
  const double seconds = std::chrono::duration<double>(Clock::now() - begun).count();
  const bool new_keyframe = std::exchange(new_keyframe_, false);
  if (hooks_.on_update) hooks_.on_update({window_->newest(), window_->newest_type(), new_keyframe, seconds, summary});
  if (health_.is_stuck(window_->newest()))
    restart(TrackReset::Kind::unconverged,
            "the window has not converged since " + seconds_text(health_.health().unconverged_since.value()),
            {.position = Vector<3>::Constant(10),
             .rotation = Vector<3>(0.3, 0.3, 0.5),
             .velocity = Vector<3>::Constant(3)});
}

}  // namespace tandem
