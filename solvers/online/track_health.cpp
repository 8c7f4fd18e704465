#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/track_health.hpp>

namespace tandem {

void check(const ResetOptions& o) {
  if (!(o.gate > 0)) throw Error("the gate (ResetOptions::gate) must be above zero; infinite, it is off");
  if (o.rejections < 1 || o.rejections > o.rejected_of)
    throw Error("a new truth is so many rejections of as many or more measurements (ResetOptions)");
  if (!(o.reset_after >= 0) || !(o.max_gap > 0) || !(o.unconverged_after > 0))
    throw Error("the times after which an estimate is given up (ResetOptions) must be above zero");
  if (!(o.lost_after > 0) || !(o.invalid_after > 0))
    throw Error("the times after which an output is lost or invalid (ResetOptions) must be above zero");
  if (o.invalid_after < o.lost_after)
    throw Error(
        "--invalid-after (ResetOptions::invalid_after) must not be below --lost-after: outputs are lost before");
}

std::string_view name(OutputState state) {
  switch (state) {
    case OutputState::aided:
      return "aided";
    case OutputState::lost:
      return "lost";
    case OutputState::invalid:
      return "invalid";
    case OutputState::none:
      break;
  }
  return "none";
}

namespace detail {
namespace {

constexpr std::size_t kMostVerdicts = 4096;
constexpr std::size_t kFewUpdates = 10;

}  // namespace

HealthMonitor::HealthMonitor(const std::vector<Sensor>& sensors, const ResetOptions& options)
    : options_(options), verdicts_(sensors.size()) {
  for (const Sensor& sensor : sensors) {
    subject_.push_back(sensor.subject);
    health_.sensors.push_back({.name = sensor.name, .heard = {}, .last_used = {}, .sigmas = {}});
  }
}

void HealthMonitor::heard(std::size_t sensor, double t) {
  auto& heard = health_.sensors[sensor].heard;
  heard = std::max(heard.value_or(t), t);
}

void HealthMonitor::used(std::size_t sensor, double t, std::optional<double> sigmas) {
  SensorHealth& s = health_.sensors[sensor];
  ++s.used;
  s.rejected_in_a_row = 0;
  s.last_used = std::max(s.last_used.value_or(t), t);
  s.sigmas = sigmas;
  judge(sensor, t, false);
}

void HealthMonitor::rejected(std::size_t sensor, double t, double sigmas) {
  SensorHealth& s = health_.sensors[sensor];
  ++s.rejected;
  ++s.rejected_in_a_row;
  s.sigmas = sigmas;
  judge(sensor, t, true);
}

void HealthMonitor::judge(std::size_t sensor, double t, bool rejected) {
  auto& verdicts = verdicts_[sensor];
  verdicts.push_back({t, rejected});
  while (verdicts.size() > kMostVerdicts ||
         (verdicts.size() > std::size_t(options_.rejected_of) && verdicts[1].t <= t - options_.reset_after))
    verdicts.pop_front();
}

bool HealthMonitor::is_new_truth(std::size_t sensor) const {
  const auto& verdicts = verdicts_[sensor];
  const auto first = std::find_if(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.rejected; });
  const auto n = std::count_if(first, verdicts.end(), [](const Verdict& v) { return v.rejected; });
  if (n < options_.rejections || verdicts.back().t - first->t < options_.reset_after) return false;
  // Of more measurements than rejected_of, the same share.
  if (double(n) * options_.rejected_of < double(options_.rejections) * double(verdicts.end() - first)) return false;
  for (std::size_t i = 0; i < subject_.size(); ++i) {
    const auto& used = health_.sensors[i].last_used;
    if (i != sensor && subject_[i] == subject_[sensor] && used && *used >= first->t) return false;
  }
  return true;
}

void HealthMonitor::updated(double t, bool converged) {
  health_.converged = converged;
  if (converged) {
    health_.unconverged_since.reset();
    unconverged_ = 0;
  } else {
    if (!health_.unconverged_since) health_.unconverged_since = t;
    ++unconverged_;
  }
}

bool HealthMonitor::is_stuck(double t) const {
  return unconverged_ >= kFewUpdates && t - *health_.unconverged_since >= options_.unconverged_after;
}

void HealthMonitor::at(double t, std::optional<double> chaser_aided, std::optional<double> target_aided) {
  health_.chaser = output(t, chaser_aided);
  health_.target = output(t, target_aided);
}

OutputHealth HealthMonitor::output(double t, std::optional<double> aided) const {
  if (!aided) return {};
  const double age = std::max(0.0, t - *aided);
  const double bad = std::max(age, t - health_.unconverged_since.value_or(t));
  const OutputState state = bad > options_.invalid_after ? OutputState::invalid
                            : age > options_.lost_after  ? OutputState::lost
                                                         : OutputState::aided;
  return {state, age};
}

double HealthMonitor::last_used(std::size_t first, std::size_t last) const {
  double t = -HUGE_VAL;
  for (std::size_t i = first; i < last; ++i) t = std::max(t, health_.sensors[i].last_used.value_or(-HUGE_VAL));
  return t;
}

void HealthMonitor::restarted(TrackReset::Kind kind) {
  ++(kind == TrackReset::Kind::suspended ? health_.suspensions : health_.resets);
  for (auto& verdicts : verdicts_) verdicts.clear();
  for (SensorHealth& sensor : health_.sensors) sensor.rejected_in_a_row = 0;
  unconverged_ = 0;  // since when the output is bad is not forgotten
}

void HealthMonitor::forget_times() {
  for (SensorHealth& sensor : health_.sensors) {
    sensor.heard.reset();
    sensor.last_used.reset();
  }
  health_.unconverged_since.reset();
}

}  // namespace detail
}  // namespace tandem
