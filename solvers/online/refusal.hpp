#pragma once

#include <string>

namespace tandem {

/// Why an online estimator did not take a line.
struct Refusal {
  enum class Kind {
    not_in_use,   ///< no such sensor here, or the chaser does not move by it
    backwards,    ///< not later than the one before it
    not_a_time,   ///< not finite, or far ahead of all others
    too_late,     ///< older than the window
    of_no_use,    ///< nothing can be made of it at its time
    implausible,  ///< no sensor reads such a value
    rejected,     ///< by the gate: too far from what is expected
  };
  Kind kind;
  std::string text;  ///< a sentence for a person
};

}  // namespace tandem
