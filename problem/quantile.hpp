#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace tandem::detail {

/// Returns the p-quantile, 0 ≤ p ≤ 1, or NaN if there are no values. Interpolates linearly between order statistics
/// (Hyndman & Fan 1996, type 7).
inline double quantile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double at = p * double(values.size() - 1), share = at - std::floor(at);
  const auto low = values.begin() + std::ptrdiff_t(at);
  std::nth_element(values.begin(), low, values.end());
  if (!(share > 0)) return *low;
  const double high = *std::min_element(low + 1, values.end());
  return high > *low ? std::lerp(*low, high, share) : *low;  // equal infinities have no difference
}

/// Returns the median, for an even number of values the mean of the two middle ones; NaN if there are no values.
inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

/// Returns the median difference of consecutive times, 0 for fewer than two times.
inline double median_step(const std::vector<double>& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return steps.empty() ? 0 : median(std::move(steps));
}

/// Returns the largest difference of consecutive times, 0 for fewer than two times.
inline double longest_step(const std::vector<double>& times) {
  double longest = 0;
  for (std::size_t i = 1; i < times.size(); ++i) longest = std::max(longest, times[i] - times[i - 1]);
  return longest;
}

}  // namespace tandem::detail
