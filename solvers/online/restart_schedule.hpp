#pragma once

#include <cmath>

namespace tandem::detail {

/// When the target is to be estimated from a fresh start too. The problem has local minima, such as a target that faces
/// backwards: from time to time, as long as all that was ever seen of it is in the window, and when a measured
/// orientation comes as a surprise.
class RestartSchedule {
 public:
  /// `age`: how far the target's keyframes reach back from the newest [s]; `whole`: none of them has left the window yet;
  /// `surprise`: angle between the newest measured orientation and the one that is held [rad]. True is acted upon.
  bool due(double newest, double age, bool whole, double surprise);

 private:
  double after_ = kFirst, last_ = -HUGE_VAL;

  static constexpr double kFirst = 5.0;  // s after the first sight of a target; then each time after twice as long
};

}  // namespace tandem::detail
