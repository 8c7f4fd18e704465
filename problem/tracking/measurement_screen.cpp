#include <algorithm>
#include <cmath>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/measurement_screen.hpp>

namespace tandem {
namespace {

constexpr double kMaxPoseDistance = 1e8, kMaxTargetDistance = 1e7;  // m
// Motion that is possible at any time, and at the start, before the typical motion is known.
constexpr double kSpeed = 5, kTurnRate = 3;                    // m/s, rad/s
constexpr double kMaxSpeed = 200, kMaxTurnRate = 50;           // m/s, rad/s
constexpr double kTypical = 10;                                // multiple of the typical motion that is possible
constexpr double kResolution = 0.05, kAngleResolution = 0.05;  // m, rad
constexpr double kTypicalTime = 10;                            // s, averaging time
constexpr int kMinSteps = 10;                                  // used poses before the typical motion counts
constexpr std::size_t kNewOrigin = 5;                          // successive displaced poses
constexpr double kReturn = 0.5;        // largest ratio of the steps from before and after a jump
constexpr double kHardestBraking = 4;  // m/s²
constexpr int kFrozenPoses = 5;        // successive equal poses

double limit(double always, double typical, double most, int steps) {
  return steps < kMinSteps ? most : std::min(most, always + kTypical * typical);
}

}  // namespace

Reading reading(SensorType type, const Measurement& m) {
  Reading numbers(12);
  Eigen::Index n = 0;
  const auto add = [&](unsigned part, const auto& values) {
    if (!type->has(part)) return;
    numbers.segment(n, values.size()) = values;
    n += values.size();
  };
  add(measured::position, m.position);
  add(measured::rotation, m.rotation.quaternion().coeffs());
  add(measured::range, Vector<1>(m.range));
  add(measured::direction | measured::angles, Vector<2>(m.azimuth, m.elevation));
  add(measured::height, Vector<1>(m.height));
  return numbers.head(n);
}

ReadingScreen::Options screen_options(const TargetSensor& sensor) {
  ReadingScreen::Options options;
  const bool position = sensor.type->has(measured::position), range = sensor.type->has(measured::range);
  options.max_magnitude = kMaxTargetDistance;
  options.vector_rows = position ? 3 : range ? 1 : 0;
  options.zero_reach = -1;  // no target is exactly at the sensor
  options.frozen_lines = 5;
  options.run_ratio = 4;
  options.may_be_constant = true;
  // The quaternion of a level target has constant numbers.
  options.axes = position || !sensor.type->has(measured::rotation) ? 3 : 0;
  return options;
}

bool OdometryScreen::can_follow(const Stamped<SE3>& before, const Stamped<SE3>& after) const {
  const double dt = after.t - before.t;
  const Vector<6> step = minus(after.value, before.value);
  return step.head<3>().norm() <= kResolution + limit(kSpeed, speed_, kMaxSpeed, steps_) * dt &&
         step.tail<3>().norm() <= kAngleResolution + limit(kTurnRate, turn_rate_, kMaxTurnRate, steps_) * dt;
}

void OdometryScreen::learn(const Stamped<SE3>& pose) {
  ++steps_;
  if (last_ && pose.t > last_->t) {
    const double dt = pose.t - last_->t, weight = std::max(1.0 / steps_, std::min(1.0, dt / kTypicalTime));
    const Vector<6> step = minus(pose.value, last_->value);
    twist_ = step / dt;
    velocity_ = (pose.value.translation() - last_->value.translation()) / dt;
    speed_ += weight * (step.head<3>().norm() / dt - speed_);
    turn_rate_ += weight * (step.tail<3>().norm() / dt - turn_rate_);
  }
  last_ = pose;
}

/// Returns whether a coordinate has been repeated for long. A vehicle at rest may repeat its pose, but slows down
/// before.
bool OdometryScreen::repeats_coordinate(const Stamped<SE3>& pose) {
  bool frozen = false;
  for (int i = 0; i < 3; ++i) {
    Run& run = runs_[std::size_t(i)];
    if (!(pose.t > last_->t) || pose.value.translation()[i] != last_->value.translation()[i]) {
      run.repeats = 0;
      continue;
    }
    if (run.repeats++ == 0) run.stopped_hard = std::abs(velocity_[i]) > kHardestBraking * (pose.t - last_->t);
    frozen |= run.stopped_hard && run.repeats >= kFrozenPoses;
  }
  return frozen;
}

OdometryScreen::Verdict OdometryScreen::judge(const Stamped<SE3>& pose) {
  const Vector<3>& p = pose.value.translation();
  if (!p.allFinite() || !(p.cwiseAbs().maxCoeff() <= kMaxPoseDistance) ||
      !pose.value.rotation().quaternion().coeffs().allFinite())
    return Verdict::missing;
  bridged_.setZero();
  if (!last_ || can_follow(*last_, pose)) {
    displaced_.clear();
    frozen_ = last_ && repeats_coordinate(pose);
    if (frozen_) return Verdict::frozen;
    learn(pose);
    return Verdict::use;
  }
  if (!displaced_.empty() && !can_follow(displaced_.back(), pose)) displaced_.clear();
  displaced_.push_back(pose);
  return displaced_.size() < kNewOrigin ? Verdict::displaced : settle();
}

/// Continues from the displaced poses, which are enough to establish an origin.
OdometryScreen::Verdict OdometryScreen::settle() {
  const Stamped<SE3>&first = displaced_.front(), &newest = displaced_.back();
  if (steps_ < int(kNewOrigin)) {
    restart();
    return Verdict::wrong_start;
  }
  const auto distance = [&](const Stamped<SE3>& from) {
    return (first.value.translation() - from.value.translation()).norm();
  };
  if (before_ && can_follow(before_->last, first) && distance(before_->last) <= kReturn * distance(*last_)) {
    first_from_current_ = before_->first_from_it;
    before_.reset();
    restart();
    return Verdict::returned;
  }
  before_ = Origin{*last_, first_from_current_};
  excursion_begin_ = first.t;
  bridged_ = (first.t - last_->t) * twist_;
  first_from_current_ = first_from_current_ * last_->value * SE3::Exp(bridged_) * first.value.inverse();
  const Stamped<SE3>& earlier = displaced_[displaced_.size() - 2];
  twist_ = minus(newest.value, earlier.value) / (newest.t - earlier.t);
  velocity_ = (newest.value.translation() - earlier.value.translation()) / (newest.t - earlier.t);
  last_ = newest;
  displaced_.clear();
  return Verdict::new_origin;
}

/// Learns from the displaced poses only.
void OdometryScreen::restart() {
  last_.reset();
  runs_ = {};
  steps_ = 0;
  speed_ = turn_rate_ = 0;
  for (const Stamped<SE3>& pose : displaced_) learn(pose);
  displaced_.clear();
}

namespace {

/// Discards missing, frozen and displaced poses. Poses after a jump to a new origin continue from the poses before.
void screen_odometry(std::vector<Stamped<SE3>>& poses, std::vector<NavigationFinding>& findings) {
  using Kind = NavigationFinding::Kind;
  NavigationFinding missing{Kind::implausible, "odometry", 0, 0, 0, std::string(text(ReadingFault::missing))};
  NavigationFinding frozen{Kind::implausible, "odometry", 0, 0, 0, std::string(text(ReadingFault::frozen))};
  NavigationFinding displaced{Kind::implausible, "odometry", 0, 0, 0, "farther away than the vehicle can move"};
  const auto discard = [](NavigationFinding& finding, double t) {
    if (finding.count++ == 0) finding.from = t;
    finding.to = t;
  };
  OdometryScreen odometry;
  std::vector<Stamped<SE3>> kept, waiting;
  for (const Stamped<SE3>& pose : poses) {
    const OdometryScreen::Verdict verdict = odometry.judge(pose);
    if (verdict == OdometryScreen::Verdict::missing) {
      discard(missing, pose.t);
      continue;
    }
    if (verdict == OdometryScreen::Verdict::frozen) {
      discard(frozen, pose.t);
      continue;
    }
    using V = OdometryScreen::Verdict;
    if (verdict == V::wrong_start || verdict == V::returned) {
      const double begin = verdict == V::returned ? odometry.excursion_begin() : -HUGE_VAL;
      const auto wrong = std::find_if(kept.begin(), kept.end(), [&](const Stamped<SE3>& k) { return k.t >= begin; });
      for (auto it = wrong; it != kept.end(); ++it) discard(displaced, it->t);
      if (verdict == V::wrong_start) {  // measurements at the start need a pose: the one that leads to the next two
        const Stamped<SE3>&first = waiting[0], &second = waiting[1];
        const Vector<6> twist = minus(second.value, first.value) / (second.t - first.t);
        const double t = kept.front().t;
        waiting.insert(waiting.begin(), {t, first.value * SE3::Exp((t - first.t) * twist)});
      }
      kept.erase(wrong, kept.end());
      std::erase_if(findings, [&](const NavigationFinding& f) { return f.kind == Kind::jump && f.from >= begin; });
      for (const Stamped<SE3>& other : waiting) kept.push_back(odometry.continued(other));
    } else if (verdict == V::new_origin) {
      for (const Stamped<SE3>& other : waiting) kept.push_back(odometry.continued(other));
      findings.push_back({Kind::jump, "odometry", 1, waiting.front().t, waiting.front().t});
    } else if (verdict == OdometryScreen::Verdict::use || odometry.displaced().size() == 1) {
      for (const Stamped<SE3>& other : waiting) discard(displaced, other.t);
    }
    if (verdict != OdometryScreen::Verdict::displaced) {
      waiting.clear();
      kept.push_back(odometry.continued(pose));
    } else {
      if (odometry.displaced().size() == 1) waiting.clear();
      waiting.push_back(pose);
    }
  }
  for (const Stamped<SE3>& other : waiting) discard(displaced, other.t);
  if (kept.size() >= 2) poses = std::move(kept);
  for (const NavigationFinding& finding : {missing, frozen, displaced})
    if (finding.count > 0) findings.push_back(finding);
}

}  // namespace

std::vector<NavigationFinding> screen(TrackingData& data) {
  std::vector<NavigationFinding> findings;
  const auto add = [&](const std::string& name, const ScreenedByFault& found) {
    for (int i = 0; i < kReadingFaults; ++i)
      if (const ScreenedLines& lines = found[std::size_t(i)]; lines.count > 0)
        findings.push_back({NavigationFinding::Kind::implausible, name, lines.count, lines.from, lines.to,
                            std::string(text(ReadingFault(i)))});
  };
  screen_odometry(data.odometry, findings);
  for (TargetSensor& sensor : data.sensors)
    add(sensor.name, screen(sensor.measurements, screen_options(sensor),
                            [&](const Measurement& m) { return reading(sensor.type, m); }));
  return findings;
}

}  // namespace tandem
