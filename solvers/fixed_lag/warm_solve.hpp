#pragma once

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag_options.hpp>
#include <tandem/solvers/fixed_lag/window_damping.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

/// Levenberg–Marquardt method for soft residuals and a good initial guess. It takes one or two steps, without overhead
/// of the order of a step: no rank analysis, no secant pairs, no final linearisation.
class WarmSolve {
 public:
  /// `cholesky` must have the Hessian pattern of `nlp`. It has the last factor afterwards.
  WarmSolve(NlpEvaluator& nlp, BlockCholesky& cholesky, const FixedLagOptions& options);

  Summary run();
  /// Returns whether the factor contains damping, or is missing.
  bool damped() const { return damped_; }
  /// Returns whether the values have moved since the linearisation of the factor.
  bool moved() const { return moved_; }

 private:
  double linearize();
  void iterate();
  bool find_step();
  bool factorize();
  /// Derivatives that are evaluated together with the cost of a step.
  enum class With { nothing, gradient, hessian };
  double cost_at_step(With with);
  void try_step();
  void accept(double cost);
  double remaining_gain();

  const FixedLagOptions& options_;
  NlpEvaluator& nlp_;
  BlockCholesky& cholesky_;
  Session session_;
  WindowDamping damping_;
  double predicted_ = 0;
  bool damped_ = true;  // also true without a factor
  bool moved_ = false;
  Eigen::VectorXd gradient_, hessian_, scale_, shift_, step_, trial_gradient_, trial_hessian_, next_;
};

}  // namespace tandem::detail
