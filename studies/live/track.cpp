#include <chrono>
#include <deque>
#include <thread>

#include <tandem/studies/live/track.hpp>
#include <tandem/studies/support/resources.hpp>

namespace tandem {
namespace {

constexpr std::size_t kRecent = 256;  // measurements to look for a keyframe's own in

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

class Tracker {
 public:
  Tracker(const Scenario& settings, const LiveOptions& options, LiveFeed& feed,
          const std::function<void(const TrackRecord&)>& each)
      : settings_(settings),
        options_(options),
        feed_(feed),
        each_(each),
        result_(moves_by_odometry(settings), !settings.data.sensors.empty(), options.ahead.size()),
        estimator_(settings.data, result_.by_odometry ? std::nullopt : settings.navigation, options.online) {
    estimator_.on_update = [this](const OnlineUpdate& update) { take(update); };
    estimator_.on_refuse = [this](const std::string& sensor, const Refusal& why) {
      result_.refused.add(sensor, reason_of(why.kind, estimator_.has_target()));
    };
    estimator_.on_reset = [this](const TrackReset& reset) {
      if (options_.tell)
        options_.tell(reset.why + (reset.kind == TrackReset::Kind::suspended
                                       ? "; the track is suspended until there is something to begin from"
                                       : "; the track begins anew"));
    };
  }

  Track run() {
    feed_.on_notice = options_.tell;
    const auto begun = Clock::now();
    while (!stopped()) {
      const auto line = feed_.next();
      if (!line || !due(*line)) break;
      give(*line);
    }
    mark_ = processor_seconds();
    estimator_.finish();
    result_.interrupted = stopped();
    result_.health = estimator_.health();
    result_.bad = bad_.longest();
    result_.seconds = std::chrono::duration<double>(Clock::now() - begun).count();
    for (const auto& [what, n] : feed_.refused().counts()) result_.refused.add(what.first, what.second, n);
    return std::move(result_);
  }

 private:
  bool stopped() const { return options_.stop && *options_.stop; }

  /// Whether the line is still wanted; in real time, waits for it.
  bool due(const FeedLine& line) {
    if (result_.lines == 0) {
      result_.first = line.t;
      start_ = Clock::now();
    }
    const double after = line.t - result_.first;
    if (after > options_.until) return false;
    while (options_.realtime && !stopped()) {
      const double ahead = after - std::chrono::duration<double>(Clock::now() - start_).count();
      if (ahead <= 0) break;
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(ahead, 0.05)));
    }
    return !stopped();
  }

  void give(const FeedLine& line) {
    const FeedStream& stream = feed_.streams().all()[line.stream];
    ++result_.lines;
    if (line.anew) {
      estimator_.begin_anew();
      recent_.clear();
      second_ = -HUGE_VAL;
      result_.first = result_.last = line.t;
      start_ = Clock::now();
    }
    result_.last = std::max(result_.lines == 1 ? line.t : result_.last, line.t);
    mark_ = processor_seconds();
    std::optional<Refusal> refused;
    switch (stream.kind) {
      case FeedStream::Kind::odometry:
        refused = estimator_.add_odometry(std::get<Stamped<SE3>>(line.data));
        break;
      case FeedStream::Kind::imu:
        refused = estimator_.add_imu(std::get<ImuSample>(line.data));
        break;
      case FeedStream::Kind::ego:
        refused = estimator_.add_ego(stream.sensor, std::get<EgoMeasurement>(line.data));
        break;
      case FeedStream::Kind::target:
        remember(stream.sensor, std::get<Measurement>(line.data));
        refused = estimator_.add_target(stream.sensor, std::get<Measurement>(line.data));
        break;
    }
    if (refused) result_.refused.add(stream.name, reason_of(refused->kind, estimator_.has_target()));
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
    RecordHealth now{health.converged, health.resets, health.suspensions, {}};
    for (const SensorHealth& sensor : health.sensors) {
      SensorRecord& record = now.sensors.emplace_back(SensorRecord{sensor.used, sensor.rejected, sensor.sigmas, {}});
      if (sensor.last_used) record.age = estimator_.newest() - *sensor.last_used;
    }
    return now;
  }

  void take(const OnlineUpdate& update) {
    TrackRecord record{
        update.t, update.type,           update.new_keyframe, update.seconds, processor_seconds() - mark_,
        {},       estimator_.keyframes()};
    const EgoState chaser = estimator_.chaser();
    record.chaser = chaser.pose;
    record.chaser_velocity = chaser.velocity;
    record.target = estimator_.target();
    if (record.target) {
      record.target_velocity = estimator_.target_velocity().value();
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
  Clock::time_point start_;
  BadSpell bad_{options_.bad_after};
  double mark_ = 0;  // processor time when the update began
  double second_ = -HUGE_VAL;
};

}  // namespace

bool moves_by_odometry(const Scenario& settings) {
  return !settings.navigation || (settings.files.odometry && !settings.data.sensors.empty());
}

std::vector<std::string> watched_sensors(const Scenario& settings) {
  std::vector<std::string> names;
  if (!moves_by_odometry(settings))
    for (const EgoSensor& sensor : settings.navigation->sensors) names.push_back(sensor.name);
  for (const TargetSensor& sensor : settings.data.sensors) names.push_back(sensor.name);
  return names;
}

Track track(const Scenario& settings, const LiveOptions& options, LiveFeed& feed,
            const std::function<void(const TrackRecord&)>& each) {
  return Tracker(settings, options, feed, each).run();
}

}  // namespace tandem
