#pragma once

#include <string>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

/// Memory lent by a solver; its content is overwritten.
struct Workspace {
  BlockCholesky& cholesky;
  Eigen::VectorXd& gradient;
  Eigen::VectorXd& hessian;
  bool has_hessian = false;  ///< whether `hessian` is the Gauss-Newton Hessian of the cost at X̄
};

/// Tests whether the problem determines each unknown at X̄ to second order. Returns an empty string if it does, else
/// the unobservable variables and directions, e.g. "target 4 in rotation about x; target 5 in x, y".
///
/// Active hard constraints count as information; active inequalities only if `inequalities` is true.
std::string unobservable_directions(NlpEvaluator& nlp, const Workspace& work, bool inequalities = true);
std::string unobservable_directions(NlpEvaluator& nlp, bool inequalities = true);
/// Returns the sentence for the user about such directions.
std::string rank_deficiency(const std::string& directions);

}  // namespace tandem::detail
