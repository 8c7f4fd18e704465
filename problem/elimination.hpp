#pragma once

#include <Eigen/Core>

namespace tandem::detail {

/// What is left of the quadratic ½ δᵀ H δ + gᵀ δ + cost, H positive semidefinite, when it is minimised over its first
/// `eliminated` unknowns: ½‖A δ + b‖² + constant over the others, with AᵀA their Schur complement.
///
/// By a Cholesky factorisation of [H g; gᵀ 2 cost] with diagonal pivoting, first among the eliminated unknowns, then
/// among the others, whose columns are the rows of A and b (Higham 1990, "Analysis of the Cholesky decomposition of a
/// semi-definite matrix"). A pivot below 10 n ε of its diagonal entry, n unknowns, is rounding: it and its kind end the
/// elimination or A. So a direction without information leaves none.
struct EliminatedQuadratic {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  double constant;
};

/// `H` by its whole symmetric array.
EliminatedQuadratic eliminate(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, double cost, int eliminated);

}  // namespace tandem::detail
