#pragma once

#include <cmath>
#include <optional>

#include <tandem/solvers/online/event_queue.hpp>

namespace tandem::detail {

/// What decides where the next keyframe stands.
struct OnlineProgress {
  double newest = -HUGE_VAL;       ///< s, of the keyframes; −∞ before the first
  double interval = 1.0;           ///< s, from one keyframe to the next where nothing is measured
  double reached = -HUGE_VAL;      ///< s: how far the chaser's motion is known
  double last_motion = -HUGE_VAL;  ///< s: how far keyframes go where nothing is measured
  /// An instant may bring more, a measurement of the target that makes a keyframe there, until the motion is past it.
  bool target_may_come = false;
  /// The chaser's own measurements join the keyframe before them, by its IMU; else they stand at keyframes of their own.
  bool joins_earlier = false;
  bool finished = false;  ///< nothing more will come
};

enum class NextStep {
  wait,      ///< for more lines
  event,     ///< take the next event: at a keyframe that is there, or one of its own
  keyframe,  ///< one in which nothing is measured, an interval after the newest
};

/// The same for lines of one instant in any order: a measurement of the chaser's own joins the keyframe of its instant,
/// if there is ever to be one.
NextStep next_step(const OnlineProgress& now, const std::optional<EventQueue::Next>& event);

}  // namespace tandem::detail
