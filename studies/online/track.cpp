#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <numeric>
#include <thread>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/online/replay_log.hpp>
#include <tandem/studies/online/reset_notice.hpp>
#include <tandem/studies/online/track.hpp>
#include <tandem/studies/online/watched_sensors.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/resources.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMaxRecent = 256;  // newest measurements that are searched for those of a keyframe
constexpr int kMinWindow = 60;           // keyframes
constexpr const char* kNotReached = "after the last keyframe of the track";

using Clock = std::chrono::steady_clock;

/// `awaits_target`: whether the sensor observes a target that is not initialised.
std::string reason_of(Rejection::Kind kind, bool awaits_target) {
  switch (kind) {
    case Rejection::Kind::not_in_use:
      return "sensor not in use";
    case Rejection::Kind::not_increasing:
      return "time runs backwards";
    case Rejection::Kind::too_late:
      return "older than the window";
    case Rejection::Kind::implausible:
      return "implausible value";
    case Rejection::Kind::outside_gate:
      return "rejected by the gate";
    case Rejection::Kind::invalid_time:
    case Rejection::Kind::unusable:
      break;
  }
  return awaits_target ? "before the first position of the target" : "not usable at its time";
}

ReplayLog::Options log_options(const OnlineOptions& online, bool odometry) {
  double window = online.lag.window;
  if (!std::isfinite(window)) window = std::max(online.lag.max_keyframes, kMinWindow);  // assumes 1 s between keyframes
  const double longest_pause = std::max(online.reset.max_gap, 2 * online.alignment);
  return {window, 4 * window + longest_pause, odometry};
}

OnlineOptions with_start(OnlineOptions online, const std::optional<TrackResumePoint>& resume) {
  if (resume) online.start = resume->snapshot.start;
  return online;
}

class Tracker {
 public:
  Tracker(const Scenario& settings, const TrackOptions& options, OnlineFeed& feed,
          const std::function<void(const TrackRecord&)>& each, const std::optional<TrackResumePoint>& resume)
      : settings_(settings),
        options_(options),
        feed_(feed),
        each_(each),
        result_(moves_by_odometry(settings), !settings.data.sensors.empty(), options.ahead.size()),
        estimator_(settings.data, result_.by_odometry ? std::nullopt : settings.navigation,
                   with_start(options.online, resume)),
        log_(log_options(options.online, result_.by_odometry), resume ? resume->snapshot.start : std::nullopt) {
    for (const JudgedSensor& sensor : watched_sensors(settings)) result_.components.push_back(sensor.components);
    for (const double t : options.at) result_.at.push_back({.t = t, .note = kNotReached});
    pending_at_.resize(options.at.size());
    std::iota(pending_at_.begin(), pending_at_.end(), std::size_t(0));
    std::stable_sort(pending_at_.begin(), pending_at_.end(),
                     [&](std::size_t a, std::size_t b) { return options.at[a] > options.at[b]; });
    estimator_.on_update = [this](const OnlineUpdate& update) { record_update(update); };
    estimator_.on_reject = [this](const std::string& sensor, const Rejection& why) { report(sensor, why); };
    estimator_.on_reset = [this](const TrackReset& r) { notify(reset_notice(r, options_.online.tracking)); };
    estimator_.on_shift = [this](std::size_t i, const InnovationShift& shift, const std::string& others) {
      notify(shift_notice(estimator_.health().sensors[i].name, result_.components[i], shift, others));
    };
  }

  Track run(const std::optional<TrackResumePoint>& resume) {
    feed_.on_notice = options_.on_notice;
    begun_ = saved_ = Clock::now();
    if (resume) restore(*resume);
    bool all_processed = true;
    while (!stopped()) {
      const auto line = feed_.next();
      result_.ended = !line && !stopped();
      if (!line) break;
      all_processed = wait_until_due(*line);
      if (!all_processed) break;
      process(*line);
      if (Clock::now() - saved_ >= std::chrono::duration<double>(options_.snapshot_every)) save();
    }
    if (all_processed) save();
    update_begin_ = processor_seconds();
    estimator_.finish();
    result_.interrupted = stopped();
    result_.health = estimator_.health();
    result_.errors = online_systematic_errors(estimator_.sensor_errors());
    result_.faulty_interval = faulty_intervals_.longest();
    result_.seconds += std::chrono::duration<double>(Clock::now() - begun_).count();
    for (const auto& [what, n] : feed_.rejected_lines().counts())
      result_.rejected_lines.add(what.first, what.second, n);
    return std::move(result_);
  }

 private:
  bool stopped() const { return options_.stop && *options_.stop; }

  /// Restores the state after the snapshot's last line: replays its lines without output, then sets all counts.
  void restore(const TrackResumePoint& resume) {
    const TrackSnapshot& snapshot = resume.snapshot;
    replaying_ = true;
    for (const FeedLine& line : snapshot.lines)
      if (!snapshot.start || !is_included(line, snapshot.start->t)) process(line);
    replaying_ = false;
    if (result_.by_odometry && estimator_.started()) to_world_ = snapshot.chaser * estimator_.chaser().pose.inverse();
    feed_.restore(snapshot.feed);
    estimator_.restore(snapshot.health, snapshot.hypotheses);
    faulty_intervals_.restore(snapshot.faulty_intervals);
    result_.rejected_lines.restore(snapshot.rejected_lines);
    result_.lines = snapshot.num_lines;
    result_.not_converged = snapshot.not_converged;
    result_.first = snapshot.first;
    result_.last = snapshot.last;
    result_.seconds = snapshot.seconds;
    const std::size_t sensors = estimator_.health().sensors.size();
    if (resume.n > 0) result_.records.load(resume.records, resume.n, sensors);
    if (resume.n > snapshot.partial.records) {
      InputFile records(resume.records);
      records.seekg(std::streamoff((resume.n - 1) * record_bytes(options_.ahead.size(), sensors)));
      records.read(reinterpret_cast<char*>(&recorded_until_), sizeof recorded_until_);  // a record begins with its time
    }
  }

  /// Returns whether the line is a measurement of the chaser's own sensors that a state at time t already includes.
  bool is_included(const FeedLine& line, double t) const {
    const auto* m = std::get_if<EgoMeasurement>(&line.data);
    if (!m) return false;
    const EgoSensor& sensor = settings_.navigation->sensors[feed_.streams().all()[line.stream].sensor];
    return sensor.valid_at(*m) <= t + kSameInstant;
  }

  void save() {
    if (!options_.on_snapshot || !estimator_.started()) return;
    std::optional<FeedCheckpoint> place = feed_.checkpoint();
    if (!place) return;  // a later call succeeds
    saved_ = Clock::now();
    options_.on_snapshot({.scenario = settings_.name,
                          .streams = streams_of(settings_, feed_.streams()),
                          .t = estimator_.newest(),
                          .chaser = to_world_ * estimator_.chaser().pose,
                          .start = log_.start(),
                          .lines = {log_.lines().begin(), log_.lines().end()},
                          .feed = std::move(*place),
                          .health = estimator_.health(),
                          .hypotheses = estimator_.hypotheses(),
                          .faulty_intervals = faulty_intervals_.checkpoint(),
                          .num_lines = result_.lines,
                          .not_converged = result_.not_converged,
                          .first = result_.first,
                          .last = result_.last,
                          .seconds = result_.seconds + std::chrono::duration<double>(saved_ - begun_).count(),
                          .rejected_lines = result_.rejected_lines.counts()});
  }

  /// In real time, waits until the time of the line. Returns false at the end of the requested data.
  bool wait_until_due(const FeedLine& line) {
    if (result_.lines == 0) result_.first = line.t;
    const double after = line.t - result_.first;
    if (!start_)
      start_ = Clock::now() - std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(after));
    if (after > options_.until) return false;
    while (options_.realtime && !stopped()) {
      const double ahead = after - std::chrono::duration<double>(Clock::now() - *start_).count();
      if (ahead <= 0) break;
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(ahead, 0.05)));
    }
    return !stopped();
  }

  void process(const FeedLine& line) {
    const FeedStream& stream = feed_.streams().all()[line.stream];
    ++result_.lines;
    if (is_missing(line)) {
      result_.rejected_lines.add(stream.name, "missing value");
      return warn(stream.name, stream.name + ": no value at " + std::to_string(line.t) + " s");
    }
    if (options_.on_snapshot) log_.add(line);
    if (line.time_reset) {
      estimator_.reset();
      recent_.clear();
      second_ = -HUGE_VAL;
      result_.first = result_.last = line.t;
      start_.reset();
      recorded_until_ = -HUGE_VAL;
    }
    result_.last = std::max(result_.lines == 1 ? line.t : result_.last, line.t);
    update_begin_ = processor_seconds();
    std::optional<Rejection> rejection;
    switch (stream.kind) {
      case FeedStream::Kind::odometry:
        rejection = estimator_.add_odometry(std::get<Stamped<SE3>>(line.data));
        break;
      case FeedStream::Kind::imu: {
        ImuSample sample = std::get<ImuSample>(line.data);
        sample.t -= settings_.navigation->imu->delay;
        rejection = estimator_.add_imu(sample);
        break;
      }
      case FeedStream::Kind::ego:
        rejection = estimator_.add_ego(stream.sensor, std::get<EgoMeasurement>(line.data));
        break;
      case FeedStream::Kind::target:
        add_recent(stream.sensor, std::get<Measurement>(line.data));
        rejection = estimator_.add_target(stream.sensor, std::get<Measurement>(line.data));
        break;
    }
    if (rejection) report(stream.name, *rejection);
  }

  /// Returns whether the line marks missing data (is_missing() of its row).
  static bool is_missing(const FeedLine& line) {
    struct {
      bool operator()(const Stamped<SE3>& pose) const { return std::isnan(pose.value.translation().x()); }
      bool operator()(const ImuSample& s) const { return std::isnan(s.specific_force.x()); }
      bool operator()(const EgoMeasurement& m) const { return std::isnan(m.value.x()); }
      bool operator()(const Measurement& m) const { return std::isnan(m.position.x()); }
    } constexpr missing;
    return std::visit(missing, line.data);
  }

  /// Counts a rejected line, and reports it if its value is wrong.
  void report(const std::string& sensor, const Rejection& why) {
    if (replaying_) return;
    const bool of_target = std::any_of(settings_.data.sensors.begin(), settings_.data.sensors.end(),
                                       [&](const TargetSensor& s) { return s.name == sensor; });
    result_.rejected_lines.add(sensor, reason_of(why.kind, of_target && !estimator_.has_target()));
    if (why.kind == Rejection::Kind::implausible || why.kind == Rejection::Kind::outside_gate) warn(sensor, why.text);
  }
  void notify(const std::string& sentence) {
    if (!replaying_ && options_.on_notice) options_.on_notice(sentence);
  }
  void warn(const std::string& sensor, const std::string& sentence) {
    if (!replaying_ && options_.on_rejected_value) options_.on_rejected_value(sensor, sentence);
  }

  void add_recent(std::size_t sensor, const Measurement& m) {
    recent_.push_back({sensor, m});
    if (recent_.size() > kMaxRecent) recent_.pop_front();
  }

  /// Sets the position or pose measured at the keyframe; a measured pose takes precedence.
  void add_measured(TrackRecord& record) const {
    for (const auto& [index, m] : recent_) {
      const TargetSensor& sensor = settings_.data.sensors[index];
      const bool pose = sensor.type == SensorType::pose;
      if (std::abs(sensor.valid_at(m) - record.t) > kSameInstant || (record.measured_rotation && !pose)) continue;
      const auto position = sensor.position_in_chaser(m);
      if (!position) continue;
      record.measured = position;
      if (pose) record.measured_rotation = sensor.pose_in_chaser(m).rotation();
    }
  }

  void add_sigmas(TrackRecord& record) const try {
    const OnlineEstimator::Covariance c = estimator_.covariance();
    const Eigen::Index n = settings_.data.planar ? 2 : 3;
    record.chaser_sigma = std::sqrt(std::max(0.0, c.chaser.topLeftCorner(n, n).trace()));
    const Eigen::Index rotations = c.chaser.rows() - n;
    record.chaser_rotation_sigma = std::sqrt(std::max(0.0, c.chaser.bottomRightCorner(rotations, rotations).trace()));
  } catch (const Error&) {  // no covariance after a failed update
  }

  void add_reported(TrackRecord& record) const {
    static constexpr double kSecond = 1;
    const SE3 chaser = estimator_.chaser().pose;
    record.reported.chaser_twist = (chaser.inverse() * estimator_.predicted_chaser(kSecond)).Log() / kSecond;
    const auto twist = [](const auto& now, const auto& next) -> std::optional<Vector<6>> {
      if (!now || !next || !now->rotation || !next->rotation) return {};
      return (SE3(*now->rotation, now->position).inverse() * SE3(*next->rotation, next->position)).Log() / kSecond;
    };
    record.reported.target_twist = twist(estimator_.target(), estimator_.predicted_target(kSecond));
    if (estimator_.uses_hypotheses()) {
      auto& window = record.reported.window_target = estimator_.window_target();
      record.reported.window_twist = twist(window, estimator_.window_target(kSecond));
      window->position = to_world_.act(window->position);
      if (window->rotation) window->rotation = to_world_.rotation() * *window->rotation;
    }
    if (!options_.report_covariance) return;
    try {
      const OnlineEstimator::Covariance c = estimator_.covariance();
      record.reported.covariance = c.joint.size() > 0 ? c.joint : c.chaser;
      record.reported.chaser_rows = c.chaser.rows();
    } catch (const NumericalError&) {  // no covariance after a failed update
    }
  }

  RecordHealth health_now() const {
    const TrackHealth& health = estimator_.health();
    RecordHealth now{health.converged, health.resets, health.suspensions, {}, health.chaser, health.target};
    for (const SensorHealth& sensor : health.sensors) {
      SensorRecord& record = now.sensors.emplace_back(SensorRecord{sensor.used, sensor.rejected, sensor.sigmas, {}});
      if (sensor.last_used) record.age = estimator_.newest() - *sensor.last_used;
      if (sensor.nis_rows > 0) record.nis = sensor.nis / double(sensor.nis_rows);
    }
    return now;
  }

  /// Answers the times up to the newest keyframe.
  void answer_times() {
    for (; !pending_at_.empty() && options_.at[pending_at_.back()] <= estimator_.newest(); pending_at_.pop_back()) {
      StateAt& state = result_.at[pending_at_.back()];
      OnlineEstimator::Instant instant = estimator_.at(state.t);
      state.note = instant.chaser ? "" : "before the first keyframe after a start or reset of the track";
      state.chaser = std::move(instant.chaser);
      state.target = std::move(instant.target);
    }
  }

  void record_update(const OnlineUpdate& update) {
    if (options_.on_snapshot && log_.wants_state(update.t)) {
      const std::optional<Alignment> start = estimator_.handover_start();
      if (start || result_.by_odometry) log_.add_state(start.value_or(Alignment{.t = update.t}));
    }
    answer_times();
    if (replaying_ || update.t <= recorded_until_) return;
    if (update.summary.status == Status::infeasible && !options_.online.soften_infeasible)
      throw Error(
          fmt::format("no motion of the target satisfies {} at t = {:.2f} s ({}); use --soften to make them soft "
                      "then, or make one of them soft now",
                      hard_options(options_.online.tracking), update.t, update.summary.message));
    TrackRecord record{
        update.t, update.type,           update.new_keyframe, update.seconds, processor_seconds() - update_begin_,
        {},       estimator_.keyframes()};
    const EgoState chaser = estimator_.chaser();
    record.chaser = to_world_ * chaser.pose;
    record.chaser_velocity = chaser.velocity;
    record.target = estimator_.target();
    if (record.target) {
      record.target->position = to_world_.act(record.target->position);
      if (record.target->rotation) record.target->rotation = to_world_.rotation() * *record.target->rotation;
      record.target_velocity = to_world_.rotation().act(estimator_.target_velocity().value());
      add_measured(record);
      record.covariance = estimator_.relative_target(0)->covariance;
    }
    for (const double h : options_.ahead) record.ahead.push_back(estimator_.relative_target(h));
    add_sigmas(record);
    if (options_.report) add_reported(record);
    if (std::floor(update.t) > second_) {
      second_ = std::floor(update.t);
      record.memory = resident_megabytes();
    }
    record.health = health_now();
    result_.not_converged += !record.health.converged;
    faulty_intervals_.updated(update.t, record.health);
    result_.records.add(record);
    if (each_) each_(record);
    update_begin_ = processor_seconds();
  }

  const Scenario& settings_;
  const TrackOptions& options_;
  OnlineFeed& feed_;
  const std::function<void(const TrackRecord&)>& each_;
  Track result_;
  OnlineEstimator estimator_;
  struct Recent {
    std::size_t sensor;
    Measurement m;
  };
  std::deque<Recent> recent_;
  Clock::time_point begun_, saved_;         // start of run(), and the last snapshot
  std::optional<Clock::time_point> start_;  // time of the first line by the wall clock, in real time
  FaultyIntervalDetector faulty_intervals_{options_.faulty_after};
  double update_begin_ = 0;    // processor time [s]
  double second_ = -HUGE_VAL;  // last second of data at which the memory was recorded
  ReplayLog log_;
  std::vector<std::size_t> pending_at_;  // indices of the times without answer, the latest first
  SE3 to_world_{};  // from the estimator's world, which restarts at the odometry pose, to that of the resumed track
  bool replaying_ = false;
  double recorded_until_ = -HUGE_VAL;  // s: the earlier process has recorded updates up to this time
};

}  // namespace

Track track(const Scenario& settings, const TrackOptions& options, OnlineFeed& feed,
            const std::function<void(const TrackRecord&)>& each, const std::optional<TrackResumePoint>& resume) {
  return Tracker(settings, options, feed, each, resume).run(resume);
}

}  // namespace tandem
