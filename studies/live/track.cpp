#include <chrono>
#include <deque>
#include <thread>

#include <tandem/studies/live/replay_log.hpp>
#include <tandem/studies/live/track.hpp>
#include <tandem/studies/navigation/navigated.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/resources.hpp>

namespace tandem {
namespace {

constexpr std::size_t kRecent = 256;  // measurements to look for a keyframe's own in
constexpr int kLeastWindow = 60;      // keyframes

using Clock = std::chrono::steady_clock;

/// Why a line was refused, in few words.
std::string reason_of(Refusal::Kind kind, bool target_there) {
  switch (kind) {
    case Refusal::Kind::not_in_use:
      return "not in use";
    case Refusal::Kind::backwards:
      return "time runs backwards";
    case Refusal::Kind::too_late:
      return "too late for the window";
    case Refusal::Kind::implausible:
      return "no such sensor reads that";
    case Refusal::Kind::rejected:
      return "rejected by the gate";
    case Refusal::Kind::not_a_time:
    case Refusal::Kind::of_no_use:
      break;
  }
  return target_there ? "of no use at its time" : "before the target was first seen";
}

ReplayLog::Options log_options(const OnlineOptions& online, bool odometry) {
  double window = online.lag.window;
  if (!std::isfinite(window)) window = std::max(online.lag.max_keyframes, kLeastWindow);  // a second apart, say
  const double patience = std::max(online.reset.max_gap, 2 * online.alignment);
  return {window, 4 * window + patience, odometry};
}

OnlineOptions from(OnlineOptions online, const std::optional<TrackBefore>& before) {
  if (before) online.start = before->snapshot.start;
  return online;
}

class Tracker {
 public:
  Tracker(const Scenario& settings, const LiveOptions& options, LiveFeed& feed,
          const std::function<void(const TrackRecord&)>& each, const std::optional<TrackBefore>& before)
      : settings_(settings),
        options_(options),
        feed_(feed),
        each_(each),
        result_(moves_by_odometry(settings), !settings.data.sensors.empty(), options.ahead.size()),
        estimator_(settings.data, result_.by_odometry ? std::nullopt : settings.navigation,
                   from(options.online, before)),
        log_(log_options(options.online, result_.by_odometry), before ? before->snapshot.start : std::nullopt) {
    estimator_.on_update = [this](const OnlineUpdate& update) { take(update); };
    estimator_.on_refuse = [this](const std::string& sensor, const Refusal& why) {
      if (!replays_) result_.refused.add(sensor, reason_of(why.kind, estimator_.has_target()));
    };
    estimator_.on_reset = [this](const TrackReset& reset) {
      if (options_.tell && !replays_)
        options_.tell(reset.why + (reset.kind == TrackReset::Kind::suspended
                                       ? "; the track is suspended until there is something to begin from"
                                       : "; the track begins anew"));
    };
  }

  Track run(const std::optional<TrackBefore>& before) {
    feed_.on_notice = options_.tell;
    begun_ = saved_ = Clock::now();
    if (before) go_on_from(*before);
    bool all_given = true;
    while (!stopped()) {
      const auto line = feed_.next();
      result_.ended = !line && !stopped();
      if (!line) break;
      all_given = due(*line);
      if (!all_given) break;
      give(*line);
      if (Clock::now() - saved_ >= std::chrono::duration<double>(options_.snapshot_every)) save();
    }
    if (all_given) save();
    mark_ = processor_seconds();
    estimator_.finish();
    result_.interrupted = stopped();
    result_.health = estimator_.health();
    result_.errors = found_errors(estimator_.sensor_errors());
    result_.bad = bad_.longest();
    result_.seconds += std::chrono::duration<double>(Clock::now() - begun_).count();
    for (const auto& [what, n] : feed_.refused().counts()) result_.refused.add(what.first, what.second, n);
    return std::move(result_);
  }

 private:
  bool stopped() const { return options_.stop && *options_.stop; }

  /// All is as after the snapshot's last line, once its lines have come again; nobody hears of them twice.
  void go_on_from(const TrackBefore& before) {
    const TrackSnapshot& then = before.snapshot;
    replays_ = true;
    for (const FeedLine& line : then.lines)
      if (!then.start || !is_known(line, then.start->t)) give(line);
    replays_ = false;
    if (result_.by_odometry && estimator_.started()) to_world_ = then.chaser * estimator_.chaser().pose.inverse();
    feed_.go_on_from(then.feed);
    estimator_.go_on_from(then.health, then.hypotheses);
    bad_.go_on_from(then.bad);
    result_.refused.go_on_from(then.refused);
    result_.lines = then.came;
    result_.not_converged = then.not_converged;
    result_.first = then.first;
    result_.last = then.last;
    result_.seconds = then.seconds;
    const std::size_t sensors = estimator_.health().sensors.size();
    if (before.n > 0) result_.records.load(before.records, before.n, sensors);
    if (before.n > then.partial.records) {
      std::ifstream records = open_input(before.records);
      records.seekg(std::streamoff((before.n - 1) * record_bytes(options_.ahead.size(), sensors)));
      records.read(reinterpret_cast<char*>(&known_until_), sizeof known_until_);  // a record begins with its time
    }
  }

  /// Whether a state at t has it in already: a measurement of the chaser's own.
  bool is_known(const FeedLine& line, double t) const {
    const auto* m = std::get_if<EgoMeasurement>(&line.data);
    if (!m) return false;
    const EgoSensor& sensor = settings_.navigation->sensors[feed_.streams().all()[line.stream].sensor];
    return sensor.valid_at(*m) <= t + kSameInstant;
  }

  void save() {
    if (!options_.on_snapshot || !estimator_.started()) return;
    std::optional<FeedPlace> place = feed_.place();
    if (!place) return;  // with one of the next lines
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
                          .bad = bad_.memory(),
                          .came = result_.lines,
                          .not_converged = result_.not_converged,
                          .first = result_.first,
                          .last = result_.last,
                          .seconds = result_.seconds + std::chrono::duration<double>(saved_ - begun_).count(),
                          .refused = result_.refused.counts()});
  }

  /// Whether the line is still wanted; in real time, waits for it.
  bool due(const FeedLine& line) {
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

  void give(const FeedLine& line) {
    const FeedStream& stream = feed_.streams().all()[line.stream];
    ++result_.lines;
    if (options_.on_snapshot) log_.add(line);
    if (line.anew) {
      estimator_.begin_anew();
      recent_.clear();
      second_ = -HUGE_VAL;
      result_.first = result_.last = line.t;
      start_.reset();
      known_until_ = -HUGE_VAL;
    }
    result_.last = std::max(result_.lines == 1 ? line.t : result_.last, line.t);
    mark_ = processor_seconds();
    std::optional<Refusal> refused;
    switch (stream.kind) {
      case FeedStream::Kind::odometry:
        refused = estimator_.add_odometry(std::get<Stamped<SE3>>(line.data));
        break;
      case FeedStream::Kind::imu: {
        ImuSample sample = std::get<ImuSample>(line.data);
        sample.t -= settings_.navigation->imu->delay;
        refused = estimator_.add_imu(sample);
        break;
      }
      case FeedStream::Kind::ego:
        refused = estimator_.add_ego(stream.sensor, std::get<EgoMeasurement>(line.data));
        break;
      case FeedStream::Kind::target:
        remember(stream.sensor, std::get<Measurement>(line.data));
        refused = estimator_.add_target(stream.sensor, std::get<Measurement>(line.data));
        break;
    }
    if (refused && !replays_) result_.refused.add(stream.name, reason_of(refused->kind, estimator_.has_target()));
  }

  void remember(std::size_t sensor, const Measurement& m) {
    recent_.push_back({sensor, m});
    if (recent_.size() > kRecent) recent_.pop_front();
  }

  /// What was measured at the newest keyframe, of the sensor that gives its type.
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
  } catch (const Error&) {  // an update that failed has none
  }

  RecordHealth health_now() const {
    const TrackHealth& health = estimator_.health();
    RecordHealth now{health.converged, health.resets, health.suspensions, {}, health.chaser, health.target};
    for (const SensorHealth& sensor : health.sensors) {
      SensorRecord& record = now.sensors.emplace_back(SensorRecord{sensor.used, sensor.rejected, sensor.sigmas, {}});
      if (sensor.last_used) record.age = estimator_.newest() - *sensor.last_used;
    }
    return now;
  }

  void take(const OnlineUpdate& update) {
    if (options_.on_snapshot && log_.wants_state(update.t)) {
      const std::optional<Alignment> start = estimator_.newest_start();
      if (start || result_.by_odometry) log_.note(start.value_or(Alignment{.t = update.t}));
    }
    if (replays_ || update.t <= known_until_) return;
    TrackRecord record{
        update.t, update.type,           update.new_keyframe, update.seconds, processor_seconds() - mark_,
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
    for (const double h : options_.ahead) {
      record.ahead.push_back(estimator_.relative_target(h));
    }
    add_sigmas(record);
    if (std::floor(update.t) > second_) {
      second_ = std::floor(update.t);
      record.memory = resident_megabytes();
    }
    record.health = health_now();
    result_.not_converged += !record.health.converged;
    bad_.updated(update.t, record.health);
    result_.records.add(record);
    if (each_) each_(record);
    mark_ = processor_seconds();
  }

  const Scenario& settings_;
  const LiveOptions& options_;
  LiveFeed& feed_;
  const std::function<void(const TrackRecord&)>& each_;
  Track result_;
  OnlineEstimator estimator_;
  struct Recent {
    std::size_t sensor;
    Measurement m;
  };
  std::deque<Recent> recent_;
  Clock::time_point begun_, saved_;         // the last snapshot
  std::optional<Clock::time_point> start_;  // when the first line was due, in real time
  BadSpell bad_{options_.bad_after};
  double mark_ = 0;  // processor time when the update began
  double second_ = -HUGE_VAL;
  ReplayLog log_;
  SE3 to_world_{};  // from the estimator's, which began at odometry's, not where an earlier track had come away from it
  bool replays_ = false;
  double known_until_ = -HUGE_VAL;  // s: an earlier track has told more of it, by lines that do not come again
};

}  // namespace

std::vector<std::string> watched_sensors(const Scenario& settings) {
  std::vector<std::string> names;
  if (!moves_by_odometry(settings))
    for (const EgoSensor& sensor : settings.navigation->sensors) names.push_back(sensor.name);
  for (const TargetSensor& sensor : settings.data.sensors) names.push_back(sensor.name);
  return names;
}

Track track(const Scenario& settings, const LiveOptions& options, LiveFeed& feed,
            const std::function<void(const TrackRecord&)>& each, const std::optional<TrackBefore>& before) {
  return Tracker(settings, options, feed, each, before).run(before);
}

}  // namespace tandem
