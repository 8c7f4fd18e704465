#pragma once

#include <Eigen/SparseCore>

#include <tandem/problem/program.hpp>

namespace tandem {

/// A program at its point as Eigen's matrices, for solvers and analyses of one's own: all with respect to the program's
/// unknowns, in their order (Program::block_of, Program::describe_unknown).
struct SparseProgram {
  double cost;
  Eigen::VectorXd gradient;              ///< of the cost
  Eigen::SparseMatrix<double> hessian;   ///< of the cost, Gauss-Newton's; both triangles
  Eigen::VectorXd constraints;           ///< c, one entry a row
  Eigen::SparseMatrix<double> jacobian;  ///< of c
  Eigen::VectorXd lower, upper;          ///< bounds of c, ±infinity where there is none
};

/// Throws Error where a residual is undefined at the point.
SparseProgram sparse(Program& program);

}  // namespace tandem
