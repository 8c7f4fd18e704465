#pragma once

#include <cmath>
#include <string>

namespace tandem {

/// The reason why an online estimator rejected a measurement (one line of a stream).
struct Rejection {
  enum class Kind {
    not_in_use,      ///< No such sensor, or the chaser does not move by it.
    not_increasing,  ///< Not later than the previous one of its stream.
    invalid_time,    ///< Not finite, or far ahead of all other streams.
    too_late,        ///< Older than the window.
    unusable,        ///< No keyframe can take it, e.g. before the target is initialised.
    implausible,     ///< A value that no sensor of this type measures.
    outside_gate,    ///< Its innovation is larger than ResetOptions::gate.
  };
  Kind kind;
  std::string text;     ///< one sentence for the user
  double t = NAN;       ///< time of validity of the measurement [s], if it is known
  double sigmas = NAN;  ///< its normalised innovation, if it is outside the gate
};

}  // namespace tandem
