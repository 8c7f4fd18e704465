#include <algorithm>
#include <numbers>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {
namespace {

constexpr double kCoarse = 5.0;        // s that a coarse alignment looks at
constexpr double kFirstRestart = 5.0;  // s after the first sight of a target; then each time after twice as long
constexpr double kSurprise =
    std::numbers::pi / 4;  // rad between a measured orientation and the one held that call for a restart
constexpr int kSettlingIterations = 100;
constexpr double kSettled = 1e-7;  // relative decrease of the cost
constexpr std::size_t kMuchOdometry = 4096;

std::string seconds_text(double t) { return std::to_string(t) + " s"; }

void check(const TrackingData& tracking, const std::optional<NavigationData>& ego, const OnlineOptions& options) {
  const TrackingOptions& o = options.tracking;
  if (o.model == MotionModel::steady_course)
    throw Error("the steady-course model is over a whole run: it has no window to estimate in as measurements come");
  const bool limited = o.limits == Role::hard && (o.surge || o.max_yaw_rate);
  if (o.roll_pitch == Role::hard || o.non_holonomic == Role::hard || limited)
    throw Error("online estimation takes soft constraints only");
  if (ego && tracking.planar)
    throw Error("a planar problem takes odometry: the chaser's own sensors are estimated in space (group SE3)");
  if (!ego && tracking.sensors.empty())
    throw Error("there is nothing to estimate: neither the chaser's own sensors nor one that observes a target");
}

}  // namespace

OnlineEstimator::OnlineEstimator(const TrackingData& tracking, const std::optional<NavigationData>& ego,
                                 const OnlineOptions& options)
    : options_(options), settings_(tracking), lag_(with_hook(options.lag)), restart_after_(kFirstRestart) {
  check(tracking, ego, options);
  for (TargetSensor& sensor : settings_.sensors) sensor.measurements.clear();
  settings_.odometry.clear();
  interval_ = ego && settings_.sensors.empty() ? ego->keyframe_interval : settings_.keyframe_interval;
  if (!ego) return;
  ego_settings_ = *ego;
  for (EgoSensor& sensor : ego_settings_->sensors) sensor.measurements.clear();
  if (ego_settings_->imu) ego_settings_->imu->samples.clear();
  waiting_ = *ego_settings_;
}

FixedLagOptions OnlineEstimator::with_hook(FixedLagOptions options) {
  options.leaving = [this](double t) {
    if (!on_leave || !chain_) return;
    for (const EgoKeyframe& k : chain_->keyframes())
      if (std::abs(k.t - t) < kSameInstant) on_leave({k.t, chain_->state(k)});
  };
  return options;
}

std::optional<std::string> OnlineEstimator::add_odometry(const Stamped<SE3>& pose) {
  if (ego_settings_) return "odometry: the chaser moves by its own sensors here";
  if (!odometry_.empty() && !(pose.t > odometry_.back().t))
    return "odometry: the pose at " + seconds_text(pose.t) + " is not later than the one before";
  if (auto why = why_not_at("odometry", pose.t)) return why;
  if (odometry_.size() > kMuchOdometry && started())
    std::erase_if(odometry_, [&](const Stamped<SE3>& x) { return x.t < newest() - 2 * interval_; });
  odometry_.push_back(pose);
  clock_ = std::max(clock_, pose.t);
  process();
  return {};
}

std::optional<std::string> OnlineEstimator::add_imu(const ImuSample& sample) {
  if (!ego_settings_ || !ego_settings_->imu) return "imu: there is no such sensor here";
  if (!(sample.t > last_imu_))
    return ego_settings_->imu->name + ": the sample at " + seconds_text(sample.t) + " is not later than the one before";
  if (auto why = why_not_at(ego_settings_->imu->name, sample.t)) return why;
  last_imu_ = sample.t;
  if (chain_) {
    chain_->add(sample);
  } else {
    waiting_.imu->samples.push_back(sample);
  }
  clock_ = std::max(clock_, sample.t);
  process();
  return {};
}

std::optional<std::string> OnlineEstimator::add_ego(std::size_t sensor, const EgoMeasurement& m) {
  if (!ego_settings_ || sensor >= ego_settings_->sensors.size()) return "there is no such sensor of the chaser here";
  const EgoSensor& by = ego_settings_->sensors[sensor];
  if (auto why = why_not_at(by.name, m.t)) return why;
  if (auto late = why_too_late(by.name, by.valid_at(m))) return late;
  if (!chain_) waiting_.sensors[sensor].measurements.push_back(m);
  return wait(m.t, by.valid_at(m), {sensor, m});
}

std::optional<std::string> OnlineEstimator::add_target(std::size_t sensor, const Measurement& m) {
  if (sensor >= settings_.sensors.size()) return "there is no such sensor of a target here";
  const TargetSensor& by = settings_.sensors[sensor];
  if (auto why = why_not_at(by.name, m.t)) return why;
  if (auto late = why_too_late(by.name, by.valid_at(m))) return late;
  return wait(m.t, by.valid_at(m), {sensor, m});
}

/// One stamp that is wrong must not carry the estimate off to its time: it takes a second line to leave the window.
std::optional<std::string> OnlineEstimator::why_not_at(const std::string& name, double stamp) {
  if (!std::isfinite(stamp)) return name + ": a time has to be finite";
  const double far = options_.lag.window;
  if (!started() || stamp <= clock_ + far || (ahead_ && std::abs(stamp - *ahead_) <= far)) {
    if (ahead_ && stamp > clock_ + far) ahead_.reset();
    return {};
  }
  ahead_ = stamp;
  return name + ": the line stamped " + seconds_text(stamp) + " is " + seconds_text(stamp - clock_) +
         " ahead of all others";
}

std::optional<std::string> OnlineEstimator::wait(double stamp, double valid, Event event) {
  pending_.emplace(valid, std::move(event));
  clock_ = std::max(clock_, stamp);
  process();
  return std::exchange(refused_, {});
}

void OnlineEstimator::finish() {
  finished_ = true;
  process();
  if (unsolved_) {
    begin_update();
    update();
  }
}

std::optional<std::string> OnlineEstimator::why_too_late(const std::string& name, double t) const {
  if (!started()) return {};
  const double first = chain_ ? chain_->keyframes().front().t : oldest();
  if (t >= first - kSameInstant) return {};
  return name + ": the measurement valid at " + seconds_text(t) + " is older than the window, which begins at " +
         seconds_text(first);
}

/// How far the chaser's motion is known [s].
double OnlineEstimator::reached() const {
  if (finished_) return HUGE_VAL;
  if (!ego_settings_) return odometry_.empty() ? -HUGE_VAL : odometry_.back().t;
  if (!ego_settings_->imu) return clock_;
  return clock_ - last_imu_ > ego_settings_->imu->max_gap ? clock_ : last_imu_;
}

/// How far keyframes go where nothing is measured [s].
double OnlineEstimator::last_motion() const {
  return std::min(reached(), ego_settings_ ? clock_ : odometry_.empty() ? -HUGE_VAL : odometry_.back().t);
}

void OnlineEstimator::process() {
  if (ego_settings_ && !chain_ && !start_chain()) return;
  while (true) {
    const double event = pending_.empty() ? HUGE_VAL : pending_.begin()->first;
    const double step = started() ? newest() + interval_ : HUGE_VAL;
    if (event <= step + kSameInstant) {
      if (event > reached() || event == HUGE_VAL) break;
      take_event();
    } else {
      // Its own instant may still bring a measurement, which gives the keyframe its type: the motion has to be past it.
      const bool may_come = !finished_ && !settings_.sensors.empty();
      if (step + (may_come ? kSameInstant : 0) > last_motion()) break;
      add_keyframe(step, 0, nullptr);
    }
    // Events of one instant share the solve.
    const bool more = !pending_.empty() && pending_.begin()->first <= std::min(newest() + kSameInstant, reached());
    if (due_ && !more) update();
  }
}

bool OnlineEstimator::start_chain() {
  const double first = start_time(waiting_).value_or(HUGE_VAL);
  if (!std::isfinite(first)) return false;
  Alignment alignment;
  if (options_.start) {
    alignment = *options_.start;
    if (last_motion() < alignment.t) return false;
  } else {
    if (!finished_ && clock_ - first < kCoarse) return false;
    alignment = coarse_alignment(waiting_);
    if (alignment.heading_unknown) {
      if (!finished_ && clock_ - first < options_.alignment) return false;
      alignment = align(waiting_, options_.alignment, options_);
    }
  }
  chain_.emplace(lag_.problem(), *ego_settings_, options_.ego);
  if (waiting_.imu)
    for (const ImuSample& sample : waiting_.imu->samples) chain_->add(sample);
  waiting_ = {};
  join(chain_->start(alignment.t, alignment.state, alignment.spread));
  while (!pending_.empty() && pending_.begin()->first < alignment.t - kSameInstant) pending_.erase(pending_.begin());
  return true;
}

void OnlineEstimator::join(const EgoKeyframe& k) {
  lag_.track(k.t, k.pose);
  lag_.track(k.t, k.velocity);
  if (k.bias) lag_.track(k.t, *k.bias);
}

void OnlineEstimator::take_event() {
  const double t = pending_.begin()->first;
  const Event event = std::move(pending_.begin()->second);
  pending_.erase(pending_.begin());
  if (const auto* m = std::get_if<EgoMeasurement>(&event.measurement)) {
    take_ego(event.sensor, *m, t);
  } else {
    take_target(event.sensor, std::get<Measurement>(event.measurement), t);
  }
}

/// Joins a keyframe that is there; its own where the inertial samples do not reach.
void OnlineEstimator::take_ego(std::size_t sensor, const EgoMeasurement& m, double t) {
  if (!chain_->reaches(t)) {
    if (t <= newest()) return refuse(ego_settings_->sensors[sensor].name, t);
    add_keyframe(t, 0, nullptr);
  }
  chain_->attach(sensor, m, t);
  unsolved_ = true;
}

/// At a keyframe of its own, but for a late one.
void OnlineEstimator::take_target(std::size_t sensor, const Measurement& m, double t) {
  const TargetSensor& by = settings_.sensors[sensor];
  const bool here = started() && std::abs(t - newest()) <= kSameInstant;
  const bool late = started() && !here && t < newest();
  if (!has_target()) {
    const bool seen = by.position_in_chaser(m).has_value();
    if (!seen || late || (!ego_settings_ && !pose_at(odometry_, t))) return refuse(by.name, t);
  }
  if (!here && !late) {
    add_keyframe(t, sensor, &m);
  } else if (!has_target()) {
    start_target(sensor, m);
  }
  begin_update();
  with_window([&](auto& window) { refuse(by.name, window.add_measurement(sensor, m)); });
}

void OnlineEstimator::refuse(const std::string& name, double t) {
  std::string why = name + ": nothing can be made of the measurement valid at " + seconds_text(t);
  if (!has_target() && !settings_.sensors.empty())
    why += "; a target starts at a measurement of its position where the chaser's motion is known";
  refuse(name, why);
}

/// Told to the hook, where there is one: the line may be an earlier one than that which is just being added.
void OnlineEstimator::refuse(const std::string& name, const std::optional<std::string>& why) {
  if (!why) return;
  if (on_refuse)
    on_refuse(name, *why);
  else
    refused_ = why;
}

void OnlineEstimator::add_keyframe(double t, std::size_t sensor, const Measurement* first) {
  begin_update();
  new_keyframe_ = true;
  const EgoKeyframe* ego = nullptr;
  if (chain_) {
    ego = &chain_->extend(t);
    join(*ego);
  }
  if (!has_target() && first) make_window();
  const SE3 dead_reckoned = chain_ ? SE3() : dead_reckoned_at(t);
  with_window([&]<LieGroup G>(detail::TargetWindow<G>& window) {
    const Variable<G>* chaser = nullptr;
    if constexpr (std::same_as<G, SE3>) chaser = ego ? &ego->pose : nullptr;
    window.add_keyframe(t, dead_reckoned, chaser, sensor, first);
    track_last(window);
  });
}

/// The chaser has a keyframe at this instant, to which a target is added.
void OnlineEstimator::start_target(std::size_t sensor, const Measurement& m) {
  make_window();
  const EgoKeyframe& ego = chain_->keyframes().back();
  detail::TargetWindow<SE3>& window = *std::get<Window<SE3>>(window_);
  window.add_keyframe(ego.t, SE3(), &ego.pose, sensor, &m);
  track_last(window);
}

void OnlineEstimator::make_window() {
  Problem& problem = lag_.problem();
  if (settings_.planar) {
    window_ = std::make_unique<detail::TargetWindow<SE2>>(problem, settings_, options_.tracking);
  } else {
    window_ = std::make_unique<detail::TargetWindow<SE3>>(problem, settings_, options_.tracking);
  }
}

template <LieGroup G>
void OnlineEstimator::track_last(const detail::TargetWindow<G>& window) {
  window.each_new_variable([&](double t, const auto& x) { lag_.track(t, x); });
}

SE3 OnlineEstimator::dead_reckoned_at(double t) const {
  const auto pose = pose_at(odometry_, t);
  return pose ? *pose : odometry_.back().value;
}

void OnlineEstimator::begin_update() {
  if (!due_) begun_ = Clock::now();
  due_ = true;
}

void OnlineEstimator::update() {
  Summary summary = lag_.update();
  due_ = unsolved_ = false;
  cost_ = summary.cost;
  trim();
  if (has_target() && restart_due()) summary = restart(summary);
  const double seconds = std::chrono::duration<double>(Clock::now() - begun_).count();
  const auto type = in_window([](const auto& w) { return w.keyframes().back().type; }, KeyframeType::gated);
  const bool new_keyframe = std::exchange(new_keyframe_, false);
  if (on_update) on_update({newest(), type, new_keyframe, seconds, summary});
}

void OnlineEstimator::trim() {
  const double oldest = lag_.oldest() - 0.5 * kSameInstant;
  if (chain_) chain_->drop_before(oldest);
  with_window([&](auto& window) { window.drop_before(oldest); });
}

/// The problem has local minima, such as a target that faces backwards: from time to time, as long as all is in the
/// window, and when a measured orientation comes as a surprise, the window is solved from a fresh start too.
bool OnlineEstimator::restart_due() {
  const double first = in_window([](const auto& w) { return w.keyframes().front().t; }, 0.0);
  const double age = newest() - first;
  const bool whole = age < options_.lag.window - interval_;
  const double surprise = in_window([](const auto& w) { return w.surprise(); }, 0.0);
  const bool surprised = surprise > kSurprise && newest() - last_restart_ > kFirstRestart;
  if (!(whole && age >= restart_after_) && !surprised) return false;
  while (restart_after_ <= age) restart_after_ *= 2;
  last_restart_ = newest();
  return true;
}

Summary OnlineEstimator::restart(const Summary& before) {
  Summary best = before;
  with_window([&](auto& window) {
    const auto kept = window.values();
    try {
      window.set_values(window.fresh_start());
    } catch (const Error&) {  // too little to start from
      window.set_values(kept);
      return;
    }
    const double cost = cost_;
    best = settle();
    if (best.cost < cost) return;
    window.set_values(kept);
    best = settle();
  });
  return best;
}

/// An update stops once steps do what they should, which is right for a warm start; this goes on to the minimum.
Summary OnlineEstimator::settle() {
  GaussNewtonOptions options;
  options.max_iterations = kSettlingIterations;
  options.cost_tolerance = kSettled;
  solve(lag_.problem(), options);
  const Summary summary = lag_.update();
  cost_ = summary.cost;
  return summary;
}

}  // namespace tandem
