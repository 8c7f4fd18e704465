#pragma once

#include <cmath>

namespace tandem::detail {

/// Decides when to re-estimate the target from a new initial guess. The problem has local minima, such as a target that
/// faces backwards. A fresh start is due at growing intervals while the window contains all measurements of the target,
/// and when a measured orientation differs much from the estimate.
class RestartSchedule {
 public:
  /// Returns whether a fresh start is due, and then counts it as done. `newest` is the time of the newest keyframe [s]
  /// and `age` the time since the first keyframe of the target [s]. `whole`: no keyframe of the target has left the
  /// window. `surprise`: angle between the newest measured orientation and the estimate [rad].
  bool due(double newest, double age, bool whole, double surprise);

 private:
  double after_ = kFirst, last_ = -HUGE_VAL;

  static constexpr double kFirst = 5.0;  // time of the first fresh start [s]; doubled each time
};

}  // namespace tandem::detail
