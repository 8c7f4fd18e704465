#pragma once

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

/// Returns how many of a sensor's first measurements contradict those after them: the first 1 to 30, at most a third of
/// all, if a jump separates them from the rest. The jump exceeds ten standard deviations and three times the largest
/// rate of change after it, between measurements without a gap. There is no such jump on either side of it.
///
/// Estimates start from the first measurements. Nothing before them can show that they are wrong.
std::size_t wrong_first_lines(const EgoSensor& sensor);

}  // namespace tandem
