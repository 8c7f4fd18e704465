#pragma once

#include <Eigen/Core>

#include <tandem/problem/problem.hpp>

namespace tandem::testing {

/// First-order (Karush–Kuhn–Tucker) conditions of a problem at its present values. Gradients and Jacobians are dense,
/// and assembled from the blocks of the problem without the code of the solvers.
struct FirstOrderConditions {
  /// Computes all members. The standard deviation of an unknown is 1/√curvature of the cost. Curvatures below
  /// `least_curvature` times the largest one count as that value. A row is active if a step of 1e-4 standard deviations
  /// reaches its bound.
  explicit FirstOrderConditions(Problem& problem, double least_curvature = 1e-12);

  /// Least residual of g + Jᵀ y = 0 over the multipliers y, which must be those of active rows and have the signs of
  /// their bounds. Each entry is relative to the sum of the magnitudes of its terms plus one standard deviation.
  double stationarity;
  /// Largest violation of a hard row, in its units.
  double violation;
  /// Least residual of Jᵀ λ = 0, relative to the gradient of the row with the largest violation. λ has the signs of the
  /// violations, is 1 for that row, and is zero for inactive rows. No step reduces all violations to first order if it
  /// vanishes.
  double infeasibility;
  double multipliers;  ///< Σ |y|: the decrease of the cost if each bound is relaxed by one
};

}  // namespace tandem::testing
