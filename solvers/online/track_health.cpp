#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/track_health.hpp>

namespace tandem {

void check(const ResetOptions& o) {
  if (!(o.gate > 0)) throw BadInputError("the gate (ResetOptions::gate) must be above zero; infinity disables it");
  if (o.rejections < 1 || o.rejections > o.rejection_window)
    throw BadInputError("ResetOptions::rejections must be between 1 and rejection_window");
  if (!(o.reset_after >= 0) || !(o.max_gap > 0) || !(o.unconverged_after > 0))
    throw BadInputError(
        "ResetOptions: reset_after must not be negative; max_gap and unconverged_after must be above zero");
  if (!(o.lost_after > 0) || !(o.invalid_after > 0))
    throw BadInputError("ResetOptions: lost_after and invalid_after must be above zero");
  if (o.invalid_after < o.lost_after)
    throw BadInputError(
        "--invalid-after (ResetOptions::invalid_after) must not be less than --lost-after (ResetOptions::lost_after)");
}

std::string_view name(OutputState state) {
  constexpr std::string_view names[] = {"none", "aided", "lost", "invalid", "unconfirmed"};
  return names[int(state)];
}

namespace detail {
namespace {

constexpr std::size_t kMaxVerdicts = 4096;
constexpr std::size_t kMinUpdates = 10;
constexpr double kAbsence = 30;      // s
constexpr double kStart = 60;        // s; first measurements, which later ones may outvote
constexpr double kSteady = 1.5;      // largest change of innovations that come from one wrong offset
constexpr std::size_t kDispute = 4;  // a sensor is disputed if it rejects more than 1/kDispute of what it used
constexpr std::size_t kWorst = 5;    // measurements

void add_innovation(SensorHealth& s, double t, const NormalizedInnovation& innovation) {
  const Eigen::VectorXd& e = innovation.standardised;
  if (e.size() == 0) return;
  if (!innovation.down_weighted) {
    s.innovations.resize(std::max(s.innovations.size(), std::size_t(e.size())));
    for (Eigen::Index i = 0; i < e.size(); ++i) s.innovations[std::size_t(i)].add(e[i]);
  }
  Eigen::Index row = 0;
  const double size = e.cwiseAbs().maxCoeff(&row);
  const auto place = std::find_if(s.worst.begin(), s.worst.end(),
                                  [&](const WorstMeasurement& w) { return std::abs(w.residual) < size; });
  s.worst.insert(place, {t, std::size_t(row), e[row]});
  if (s.worst.size() > kWorst) s.worst.pop_back();
}

}  // namespace

HealthMonitor::HealthMonitor(const std::vector<Sensor>& sensors, const ResetOptions& options)
    : options_(options),
      sensors_(sensors),
      rejected_since_(sensors.size()),
      first_used_(sensors.size()),
      rejected_by_(sensors.size()),
      shifts_(sensors.size()),
      verdicts_(sensors.size()) {
  for (const Sensor& sensor : sensors) {
    health_.sensors.push_back({.name = sensor.name, .last_received = {}, .last_used = {}, .sigmas = {}});
  }
}

void HealthMonitor::received(std::size_t sensor, double t) {
  auto& last = health_.sensors[sensor].last_received;
  last = std::max(last.value_or(t), t);
}

std::optional<InnovationShift> HealthMonitor::used(std::size_t sensor, double t,
                                                   const NormalizedInnovation& innovation) {
  SensorHealth& s = health_.sensors[sensor];
  ++s.used;
  s.rejected_in_a_row = 0;
  rejected_since_[sensor].reset();
  s.last_used = std::max(s.last_used.value_or(t), t);
  if (!first_used_[sensor]) first_used_[sensor] = t;
  s.sigmas = innovation.sigmas;
  s.nis += innovation.nis;
  s.nis_rows += innovation.rows;
  s.down_weighted += innovation.down_weighted;
  s.expected_down_weighted += innovation.expected_down_weighted;
  const auto shift = shifts_[sensor].add(t, innovation.standardised, s.innovations);
  add_innovation(s, t, innovation);
  add_verdict(sensor, t, false);
  return shift;
}

void HealthMonitor::rejected(std::size_t sensor, double t, double sigmas) {
  SensorHealth& s = health_.sensors[sensor];
  ++s.rejected;
  Offset& by = rejected_by_[sensor];
  if (s.rejected_in_a_row == 0) by = {sigmas};
  const double last = s.rejected_in_a_row == 0 ? sigmas : *s.sigmas;
  by = {std::min(by.least, sigmas), by.constant && sigmas <= kSteady * by.least && last <= kSteady * sigmas};
  ++s.rejected_in_a_row;
  s.sigmas = sigmas;
  if (!rejected_since_[sensor]) rejected_since_[sensor] = t;
  shifts_[sensor].clear();
  add_verdict(sensor, t, true);
}

void HealthMonitor::add_verdict(std::size_t sensor, double t, bool rejected) {
  auto& verdicts = verdicts_[sensor];
  verdicts.push_back({t, rejected});
  while (verdicts.size() > kMaxVerdicts ||
         (verdicts.size() > std::size_t(options_.rejection_window) && verdicts[1].t <= t - options_.reset_after))
    verdicts.pop_front();
}

std::optional<double> HealthMonitor::contradicting_since(std::size_t sensor) const {
  const auto& verdicts = verdicts_[sensor];
  const auto first = std::find_if(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.rejected; });
  const auto n = std::count_if(first, verdicts.end(), [](const Verdict& v) { return v.rejected; });
  if (n < options_.rejections || verdicts.back().t - first->t < options_.reset_after) return {};
  // With more than rejection_window measurements, requires the same share of rejections.
  if (double(n) * options_.rejection_window < double(options_.rejections) * double(verdicts.end() - first)) return {};
  return first->t;
}

bool HealthMonitor::is_confirmed(std::size_t sensor, double t, bool only_same) const {
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const bool same = sensors_[i].subject == sensors_[sensor].subject;
    const bool other =
        !only_same && sensors_[i].subject >= 0 && ((sensors_[sensor].confirmed_by >> sensors_[i].subject) & 1u);
    const auto& used = health_.sensors[i].last_used;
    if (i != sensor && (same || other) && used && *used >= t) return true;
  }
  return false;
}

bool HealthMonitor::must_reset_to(std::size_t sensor) const {
  const auto since = contradicting_since(sensor);
  if (!since) return false;
  const SensorHealth& own = health_.sensors[sensor];
  const bool was_absent = !own.last_used || rejected_since_[sensor].value_or(*since) - *own.last_used > kAbsence;
  return !is_confirmed(sensor, *since, was_absent || outvotes_its_start(sensor));
}

bool HealthMonitor::outvotes_its_start(std::size_t sensor) const {
  // Wrong first measurements agree with the motion that other sensors measure, and the later ones do so, too.
  const SensorHealth& own = health_.sensors[sensor];
  if (own.rejected_in_a_row <= own.used) return false;
  if (own.used < std::size_t(options_.rejections)) return true;
  return sensors_[sensor].absolute && first_used_[sensor] && *own.last_used - *first_used_[sensor] <= kStart &&
         rejected_by_[sensor].constant;
}

bool HealthMonitor::is_disputed(double t) const {
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const SensorHealth& own = health_.sensors[i];
    if (sensors_[i].subject < 0 || !sensors_[i].absolute) continue;
    if (own.rejected_in_a_row < std::size_t(options_.rejections)) continue;
    if (kDispute * own.rejected_in_a_row > own.used && other_agreeing_sensors(i, t).empty()) return true;
  }
  return false;
}

bool HealthMonitor::is_shifted(double t, bool of_target) const {
  for (std::size_t i = 0; i < sensors_.size(); ++i)
    if (shifts_[i].is_shifted() && (sensors_[i].subject < 0) == of_target && agrees(i, t)) return true;
  return false;
}

bool HealthMonitor::contradicts(std::size_t sensor, double t) const {
  return health_.sensors[sensor].rejected_in_a_row >= std::size_t(options_.rejections) &&
         t - verdicts_[sensor].back().t <= options_.reset_after;
}

std::optional<double> HealthMonitor::all_contradicting_since(double t) const {
  std::optional<double> since;
  std::optional<int> subject;
  bool several = false;
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    if (!contradicts(i, t)) continue;
    several |= subject && *subject != sensors_[i].subject;
    subject = sensors_[i].subject;
    since = std::min(since.value_or(HUGE_VAL), rejected_since_[i].value());
  }
  return several ? since : std::nullopt;
}

std::string HealthMonitor::contradicting_sensors(double t) const {
  return names([&](std::size_t i) { return contradicts(i, t); });
}

void HealthMonitor::adopt(std::size_t sensor) {
  const auto& used = health_.sensors[sensor].last_used;
  const double t = verdicts_[sensor].back().t;
  if (used && rejected_since_[sensor].value_or(t) - *used <= kAbsence)
    adopted_[sensors_[sensor].subject < 0] = Adopted{sensor, t};
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
  return unconverged_ >= kMinUpdates && t - *health_.unconverged_since >= options_.unconverged_after;
}

void HealthMonitor::update_outputs(double t, std::optional<double> chaser_aided, std::optional<double> target_aided) {
  health_.chaser = output(t, chaser_aided, false);
  health_.target = output(t, target_aided, true);
}

void HealthMonitor::set_confirmed(bool chaser, bool target) {
  health_.chaser.confirmed = chaser && health_.chaser.state == OutputState::aided;
  health_.target.confirmed = target && health_.target.state == OutputState::aided;
}

bool HealthMonitor::agrees(std::size_t sensor, double t) const {
  const SensorHealth& s = health_.sensors[sensor];
  return s.rejected_in_a_row == 0 && t - s.last_used.value_or(-HUGE_VAL) <= options_.lost_after;
}

std::string HealthMonitor::other_agreeing_sensors(std::size_t sensor, double t) const {
  return names(
      [&](std::size_t i) { return i != sensor && sensors_[i].subject == sensors_[sensor].subject && agrees(i, t); });
}

OutputHealth HealthMonitor::output(double t, std::optional<double> aided, bool of_target) {
  if (!aided) return {};
  std::optional<Adopted>& adopted = adopted_[of_target];
  if (adopted && is_confirmed(adopted->sensor, adopted->t, false)) adopted.reset();
  const double age = std::max(0.0, t - *aided);
  const double bad = std::max(age, t - health_.unconverged_since.value_or(t));
  const OutputState state = bad > options_.invalid_after ? OutputState::invalid
                            : age > options_.lost_after  ? OutputState::lost
                            : adopted || (!of_target && is_disputed(t)) || is_shifted(t, of_target)
                                ? OutputState::unconfirmed
                                : OutputState::aided;
  return {state, age};
}

double HealthMonitor::last_used(std::size_t first, std::size_t last) const {
  double t = -HUGE_VAL;
  for (std::size_t i = first; i < last; ++i) t = std::max(t, health_.sensors[i].last_used.value_or(-HUGE_VAL));
  return t;
}

void HealthMonitor::record_reset(TrackReset::Kind kind) {
  ++(kind == TrackReset::Kind::suspended ? health_.suspensions : health_.resets);
  for (auto& verdicts : verdicts_) verdicts.clear();
  for (ShiftDetector& shift : shifts_) shift.clear();
  for (SensorHealth& sensor : health_.sensors) sensor.rejected_in_a_row = 0;
  unconverged_ = 0;  // health_.unconverged_since stays: outputs remain bad
}

void HealthMonitor::forget_times() {
  for (SensorHealth& sensor : health_.sensors) {
    sensor.last_received.reset();
    sensor.last_used.reset();
  }
  for (auto& since : rejected_since_) since.reset();
  for (auto& first : first_used_) first.reset();
  for (auto& adopted : adopted_) adopted.reset();
  for (ShiftDetector& shift : shifts_) shift.clear();
  health_.unconverged_since.reset();
}

}  // namespace detail
}  // namespace tandem
