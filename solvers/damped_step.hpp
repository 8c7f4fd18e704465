#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::detail {

/// Damping of Levenberg–Marquardt steps, as a multiple of the diagonal of the Hessian, by Nielsen's rule (1999).
/// Accepted steps reduce it, the more so the better the model predicted the gain. Consecutive rejections increase it
/// ever faster.
struct Damping {
  double value;
  double min_value;     ///< minimum of `value`
  double min_rejected;  ///< minimum of `value` before the increase at a rejection
  double growth;        ///< factor at the first rejection
  double acceleration;  ///< growth of that factor from one rejection to the next
  double next_growth = growth;

  /// Updates the damping after an accepted step with the given step acceptance ratio, actual over predicted gain.
  void accept(double ratio) {
    value = std::max(min_value, value * std::max(0.1, 1 - std::pow(2 * ratio - 1, 3)));
    next_growth = growth;
  }
  void reject() {
    value = std::max(value, min_rejected) * next_growth;
    next_growth *= acceleration;
  }
};

/// Relative curvature that may be the square of a Jacobian's rounding error. It is the curvature of an unknown, divided
/// by the largest curvature of its coupled unknowns.
inline constexpr double kRoundingCurvature = 1e-20;

/// Returns the largest curvature(k) of the unknowns k of one variable that are coupled with unknown i, or are i. They
/// share a residual, whose rounding may thus be the curvature of i. The block of the variable in the Hessian is given
/// by its first value and the distance of its columns.
template <class F>
double largest_coupled(const double* block, int stride, int width, int i, F curvature) {
  double largest = curvature(i);
  for (int k = 0; k < width; ++k)
    if (block[k * stride + i] != 0 || block[i * stride + k] != 0) largest = std::max(largest, curvature(k));
  return largest;
}

/// Returns the addition to a diagonal entry of the Hessian. `scale` is the curvature of the cost. `diagonal` is that of
/// the whole matrix, and `largest` its maximum over the coupled unknowns. An unknown without curvature beyond rounding
/// gets a large pivot, hence no step.
inline double damping_shift(double damping, double scale, double diagonal, double largest) {
  if (diagonal > kRoundingCurvature * largest) return std::max(damping * scale, std::numeric_limits<double>::min());
  return largest > 0 ? largest : 1.0;
}

}  // namespace tandem::detail
