#pragma once

#include <algorithm>
#include <cmath>

#include <tandem/problem/function_ref.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>

namespace tandem::detail {

/// Drop of the log evidence that excludes a factor: about half the 95 % quantile of χ² with one degree of freedom.
inline constexpr double kEvidenceDrop = 2.0;
/// Largest half width of a range of log factors, a factor of 10. Wider ranges count as flat.
inline constexpr double kMaxHalfWidth = 2.31;

/// Value and slope of a profile log evidence, as a function of one log factor. The value is −∞ where there is none.
struct ProfilePoint {
  double value, slope;
};

/// The range of log factors in which the profile evidence stays within kEvidenceDrop of its maximum.
struct FlatRange {
  double from, to;  ///< infinite if the evidence does not fall within kMaxHalfWidth, or becomes flat before
  /// Whether the evidence falls at this end. False if the range ends because the problem cannot be solved beyond.
  bool bounded_below, bounded_above;

  /// Writes the range and the verdict to `noise`, for an estimate `log_factor`.
  void assign_to(CalibratedNoise& noise, double log_factor) const {
    noise.flat_from = std::exp(std::max(from, log_factor - kMaxHalfWidth));
    noise.flat_to = std::exp(std::min(to, log_factor + kMaxHalfWidth));
    noise.identifiable = bounded_below && bounded_above;
    noise.bounded = !noise.identifiable && ((bounded_below && from > 0) || (bounded_above && to < 0));
  }
};

/// Finds the range around the log factor `from`, whose profile evidence is `here`. Evaluates `profile_at` at growing
/// distances, `first_reach` first, within [−bound, bound].
FlatRange flat_range(double from, const ProfilePoint& here, double first_reach, double bound,
                     FunctionRef<ProfilePoint(double)> profile_at);

/// Returns whether the data constrain a log factor at least as well as its prior does. `data_curvature` is the
/// curvature of the profile evidence, `prior` a standard deviation (0: no prior, which counts as kMaxHalfWidth).
inline bool is_identifiable(double data_curvature, double prior) {
  const double prior_sigma = prior > 0 ? std::min(prior, kMaxHalfWidth) : kMaxHalfWidth;
  return data_curvature * prior_sigma * prior_sigma >= 1;
}

}  // namespace tandem::detail
