#pragma once

#include <Eigen/Core>

namespace tandem::detail {

/// Elimination step of a Gaussian under linear constraints. The variable f of the front (n unknowns) and its neighbours
/// s eliminated later (m − n) have the density exp(−½ [f; s]ᵀ H [f; s]) on M [f; s] = 0. Constraints determine a part
/// of f exactly; the rest has its own information. The result is f = T s + z with covariance D of z, and the remaining
/// information and constraints on s.
///
/// This is the null-space method on fronts. It causes no fill beyond that of the unconstrained factor, and needs no
/// penalty. M is triangularised orthogonally; ranks are determined as in Heath 1982 and SPQR (Davis 2011). Redundant
/// rows become zero and are dropped.
struct ConstrainedFront {
  /// `panel` (m × n) has the columns of H of f. `constraints` (p × m) is M, with rows of norm ≤ 1.
  ConstrainedFront(const Eigen::Ref<const Eigen::MatrixXd>& panel, const Eigen::MatrixXd& constraints);

  /// Smaller entries of a row that had norm 1 count as rounding.
  static constexpr double tolerance = 1e-10;

  /// False if a direction of f is neither constrained nor has information. The other members are then not set.
  bool positive = true;
  Eigen::MatrixXd Tt;          ///< Tᵀ, (m − n) × n.
  Eigen::MatrixXd D;           ///< n × n; its rank is the number of unconstrained directions.
  Eigen::MatrixXd A, B;        ///< H of s decreases by A Bᵀ; both m × any, first n rows unused.
  Eigen::VectorXd added;       ///< m − n: upper bound of the increase of the diagonal of H of s by constraints.
  Eigen::MatrixXd remaining;   ///< Constraints that remain on s, any × (m − n).
  Eigen::VectorXd pivots;      ///< Pivots of the unconstrained directions of f.
  Eigen::MatrixXd directions;  ///< The unconstrained directions, n × any.
};

}  // namespace tandem::detail
