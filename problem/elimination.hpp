#pragma once

#include <Eigen/Core>

namespace tandem::detail {

/// The quadratic ½‖A δ + b‖² + constant of the unknowns that eliminate() keeps.
struct EliminatedQuadratic {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  double constant;
};

/// Minimises ½ δᵀ H δ + gᵀ δ + cost over the first `eliminated` of the n unknowns. `H` is positive semidefinite and
/// given in full. AᵀA is the Schur complement of the remaining unknowns.
///
/// Factorises [H g; gᵀ 2 cost] by Cholesky with diagonal pivoting, first over the eliminated unknowns, then over the
/// others. Source: Higham 1990, "Analysis of the Cholesky decomposition of a semi-definite matrix". Pivots below 10 n ε
/// of their diagonal entry are treated as zero, so directions without information yield no row of A.
EliminatedQuadratic eliminate(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, double cost, int eliminated);

/// Linear equations A δ + b = 0.
struct LinearRows {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
};

/// The quadratic of the unknowns that eliminate() keeps, and the equations that remain on them.
struct EliminatedProgram : EliminatedQuadratic {
  LinearRows equations;  ///< of full row rank, orthonormal up to the scale of the given rows
};

/// Minimises the same under `equations` on all n unknowns, by the null-space method.
///
/// An orthogonal triangularisation with column pivoting separates the equations into rows that determine a part of the
/// eliminated unknowns x by the others s, and rows on s alone:
///
///   [C_x C_s] → [R B₁; 0 B₂]      x = G s + f + Z y      B₂ s + d₂ = 0
///
/// Z spans the null space of R. Substitution gives a quadratic in y and s, from which y is eliminated as above.
/// Equations that depend on others are dropped. Source: Nocedal & Wright 2006, §16.2.
EliminatedProgram eliminate(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, double cost, int eliminated,
                            const LinearRows& equations);

}  // namespace tandem::detail
