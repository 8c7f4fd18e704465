#pragma once

#include <string>

namespace tandem {

/// The reason why an online estimator rejected a measurement (one line of a stream).
struct Rejection {
  enum class Kind {
    not_in_use,      ///< no such sensor, or the chaser does not move by it
    not_increasing,  ///< not later than the previous one of its stream
    invalid_time,    ///< not finite, or far ahead of all other streams
    too_late,        ///< older than the window
    unusable,        ///< no keyframe can take it, e.g. before the target is initialised
    implausible,     ///< a value that no sensor of this type measures
    outside_gate,    ///< its innovation is larger than ResetOptions::gate
  };
  Kind kind;
  std::string text;  ///< one sentence for the user
};

}  // namespace tandem
