#pragma once

#include <string>

#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// Returns one sentence if the times of a recording are probably wrong and would need much time and memory, otherwise
/// an empty string. Detects times that are not in seconds, gaps of more than an hour (one sensor on another clock), and
/// more than 200,000 keyframes. The run time is O(n log n) in the number of rows and does not depend on the time span.
std::string implausible_times(const Scenario& scenario);

}  // namespace tandem
