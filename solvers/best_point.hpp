#pragma once

#include <cmath>
#include <limits>

namespace tandem::detail {

/// By what a solver that is stopped knows its best point: the feasible one of least cost; while there is none, that of
/// least violation. Of equals the later.
struct BestPoint {
  double feasible;  ///< the largest violation of a point that meets the hard constraints
  double cost = std::numeric_limits<double>::infinity();
  double violation = std::numeric_limits<double>::infinity();

  /// Whether this point is the best so far; it is then taken note of.
  bool offer(double new_cost, double new_violation) {
    const bool both = violation <= feasible && new_violation <= feasible;
    if (!std::isfinite(new_cost) || !(both ? new_cost <= cost : new_violation <= violation)) return false;
    cost = new_cost;
    violation = new_violation;
    return true;
  }
};

}  // namespace tandem::detail
