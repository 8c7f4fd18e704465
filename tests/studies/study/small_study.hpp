#pragma once

#include <string>

#include <tandem/studies/study/study.hpp>

namespace tandem {

/// A study of 24 trials of one minute. 8 of them are invalid: the constant-velocity model has no orientation to
/// constrain.
inline const char* const kSmallStudy =
    "name: small\n"
    "parameters: {minutes: 1, blind: 0, gap: [0, 10], gap_period: 40}\n"
    "models: [constant-twist, mode-b, constant-velocity+non-holonomic:soft]\n"
    "seeds: 4\n";

inline Study small_study() { return parse_study(kSmallStudy, "small.yaml"); }

}  // namespace tandem
