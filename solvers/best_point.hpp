#pragma once

#include <cmath>
#include <limits>

namespace tandem::detail {

/// Best point so far: the feasible point with the least cost or, without one, the point with the least violation. Later
/// points win ties.
struct BestPoint {
  double feasible;  ///< tolerance on the violation of a feasible point
  double cost = std::numeric_limits<double>::infinity();
  double violation = std::numeric_limits<double>::infinity();

  /// Returns whether the point is the best so far, and records it if so.
  bool offer(double new_cost, double new_violation) {
    const bool both = violation <= feasible && new_violation <= feasible;
    if (!std::isfinite(new_cost) || !(both ? new_cost <= cost : new_violation <= violation)) return false;
    cost = new_cost;
    violation = new_violation;
    return true;
  }
};

}  // namespace tandem::detail
