#pragma once

#include <Eigen/Core>

namespace tandem::detail {

/// One step of the elimination of variables whose Gaussian is confined to linear constraints. The front's variable
/// f (n unknowns) and the later ones s that it touches (m − n) have the density exp(−½ [f; s]ᵀ H [f; s]) on
/// M [f; s] = 0. What M determines of f it determines exactly, however little else is known of it; the rest of f has
/// its own information. The result is f = T s + z, z of covariance D, and what is left to say about s.
///
/// This is the null-space method done by fronts, so that no fill arises that the unconstrained factor has not, and no
/// penalty has to be chosen: M is triangularised by rows orthogonally, ranks found as in Heath 1982 and SPQR (Davis
/// 2011). Redundant rows become zero and are dropped.
struct ConstrainedFront {
  /// `panel` (m × n): the columns of H of f. `constraints` (p × m): M, rows of norm ≤ 1.
  ConstrainedFront(const Eigen::Ref<const Eigen::MatrixXd>& panel, const Eigen::MatrixXd& constraints);

  /// What is smaller than this in a row that had norm 1 is rounding.
  static constexpr double tolerance = 1e-10;

  bool positive = true;        ///< false when a direction of f is neither constrained nor informed; then nothing else
  Eigen::MatrixXd Tt;          ///< Tᵀ, (m − n) × n
  Eigen::MatrixXd D;           ///< n × n, of the rank that the constraints leave
  Eigen::MatrixXd A, B;        ///< H of s loses A Bᵀ; both m × any, the first n rows unused
  Eigen::VectorXd added;       ///< m − n: what the constraints alone add to the diagonal of H of s, at the most
  Eigen::MatrixXd remaining;   ///< constraints left on s, any × (m − n)
  Eigen::VectorXd pivots;      ///< of the unconstrained directions of f
  Eigen::MatrixXd directions;  ///< these, n × any
};

}  // namespace tandem::detail
