#include <tandem/studies/online/faulty_interval.hpp>

namespace tandem {

void FaultyIntervalDetector::updated(double t, const RecordHealth& health) {
  std::size_t used = 0;
  for (const SensorRecord& sensor : health.sensors) used += sensor.used;
  const std::size_t rejected = health.rejected();
  auto& [used_before, rejected_before, rejecting, now, longest] = state_;
  rejecting = used == used_before && (rejected > rejected_before || rejecting);
  used_before = used;
  rejected_before = rejected;
  if (health.converged && !rejecting) {
    now.reset();
    return;
  }
  if (!now) now = Interval{t, t, true};
  now->until = t;
  if (!longest || now->until - now->since > longest->until - longest->since || longest->since == now->since)
    longest = now;
}

std::optional<FaultyIntervalDetector::Interval> FaultyIntervalDetector::longest() const {
  const std::optional<Interval>& longest = state_.longest;
  if (!longest || longest->until - longest->since < min_duration_) return {};
  Interval interval = *longest;
  interval.ongoing = state_.now && state_.now->since == interval.since;
  return interval;
}

}  // namespace tandem
