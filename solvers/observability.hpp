#pragma once

#include <string>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

/// What a solve has at hand of its program's sizes, overwritten where it is lent.
struct Workspace {
  BlockCholesky& cholesky;
  Eigen::VectorXd& gradient;
  Eigen::VectorXd& hessian;
  bool has_hessian = false;  ///< Gauss-Newton's of the cost where the variables are
};

/// Empty when the point determines every unknown to second order, else a sentence that names the free variables and
/// directions, e.g. "the problem leaves free: target 4 in rotation about x (…)". Hard
/// constraints that hold count as information; inequalities at their bounds only with `inequalities`.
std::string free_directions(Program& program, const Workspace& work, bool inequalities = true);
std::string free_directions(Program& program, bool inequalities = true);

}  // namespace tandem::detail
