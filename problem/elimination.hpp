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

}  // namespace tandem::detail
