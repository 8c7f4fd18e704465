#pragma once

#include <Eigen/SparseCore>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem {

/// The linearized program of an NlpEvaluator as Eigen matrices, for a custom solver or analysis. Columns are the
/// unknowns of the evaluator, in their order (NlpEvaluator::block_of, NlpEvaluator::describe_unknown).
struct SparseNlp {
  double cost;
  Eigen::VectorXd gradient;              ///< gradient of the cost
  Eigen::SparseMatrix<double> hessian;   ///< Gauss-Newton Hessian of the cost, both triangles
  Eigen::VectorXd constraints;           ///< constraint rows c
  Eigen::SparseMatrix<double> jacobian;  ///< Jacobian of c
  Eigen::VectorXd lower, upper;          ///< bounds of c, ±infinity if unbounded
};

/// Linearizes the program at the point of `nlp`. Throws Error if a residual is undefined there.
SparseNlp sparse(NlpEvaluator& nlp);

}  // namespace tandem
