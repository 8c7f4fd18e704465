#include <tandem/solvers/online/keyframe_policy.hpp>

namespace tandem::detail {

NextStep next_step(const OnlineProgress& now, const std::optional<EventQueue::Next>& event) {
  const double step = std::isfinite(now.newest) ? now.newest + now.interval : HUGE_VAL;
  const double margin = now.expects_target && !now.finished ? kSameInstant : 0.0;
  const NextStep otherwise = step + margin <= now.keyframe_limit ? NextStep::keyframe : NextStep::wait;
  if (!event) return otherwise;
  const auto when = [](bool ready) { return ready ? NextStep::event : NextStep::wait; };
  const double t = event->t;
  if (t <= now.newest + kSameInstant) return when(t <= now.motion_end);  // attaches to an existing keyframe
  if (event->of_target || !now.attaches_to_earlier)
    return t <= step + kSameInstant ? when(t <= now.motion_end) : otherwise;
  if (t < step - kSameInstant) return when(t + margin <= now.motion_end);
  return now.finished && otherwise == NextStep::wait ? when(t <= now.motion_end) : otherwise;
}

}  // namespace tandem::detail
