#pragma once

#include <algorithm>
#include <utility>
#include <vector>

namespace tandem::detail {

/// The middle one of some values, the upper of two; there has to be one.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Of the steps from one time to the next; 0 where there are none.
inline double median_step(const std::vector<double>& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return steps.empty() ? 0 : median(std::move(steps));
}

}  // namespace tandem::detail
