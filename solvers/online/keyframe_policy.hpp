#pragma once

#include <cmath>
#include <optional>

#include <tandem/solvers/online/event_queue.hpp>

namespace tandem::detail {

/// The state of an online estimator that decides where the next keyframe is placed.
struct OnlineProgress {
  double newest = -HUGE_VAL;          ///< Newest keyframe [s]; −∞ before the first.
  double interval = 1.0;              ///< Time between keyframes without measurements [s].
  double motion_end = -HUGE_VAL;      ///< End of the known motion of the chaser [s].
  double keyframe_limit = -HUGE_VAL;  ///< Latest time of a keyframe without measurements [s].
  /// There are sensors of the target. A measurement that creates a keyframe may still arrive until the motion is past
  /// its time.
  bool expects_target = false;
  /// The chaser's own measurements attach to the previous keyframe through the IMU. Otherwise, they create keyframes.
  bool attaches_to_earlier = false;
  bool finished = false;  ///< no more data will arrive
};

enum class NextStep {
  wait,      ///< wait for more data
  event,     ///< process the next event, at an existing keyframe or at a new one
  keyframe,  ///< add a keyframe without measurements, one interval after the newest
};

/// Decides the next step. The decision does not depend on the order of simultaneous measurements: a measurement of the
/// chaser attaches to the keyframe of its time if there will be one.
NextStep next_step(const OnlineProgress& now, const std::optional<EventQueue::Next>& event);

}  // namespace tandem::detail
