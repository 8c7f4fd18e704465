#pragma once

#include <optional>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::detail {

/// First-order (Karush–Kuhn–Tucker) conditions at X̄, with multipliers that do not come from the solver that is checked.
struct FirstOrderCheck {
  /// Largest entry of g + Jᵀ y [standard deviations], relative to the magnitudes of its terms plus one standard
  /// deviation.
  double stationarity;
  bool feasible;                ///< the hard rows are met
  Eigen::VectorXd multipliers;  ///< y of each row, with the sign of its bound, 0 for inactive rows
};

/// Finds the multipliers y that make g + Jᵀ y smallest, with the signs of the active bounds. An unknown without
/// curvature has the standard deviation of the softest other one. Curvatures below `least_curvature` times the largest
/// one count as that value. Takes one linearisation and a few factorizations. Returns nothing if derivatives are
/// undefined or the multipliers cannot be computed. The point is X̄ afterwards.
std::optional<FirstOrderCheck> check_first_order(NlpEvaluator& nlp, double least_curvature);

}  // namespace tandem::detail
