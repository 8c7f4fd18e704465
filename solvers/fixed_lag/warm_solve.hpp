#pragma once

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/damped_step.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag_options.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

/// Information that is added to an unobservable unknown. If only a combination of unknowns is unobservable, such as the
/// heading of a target with position measurements only, it is relative to the diagonal entry. The value is far above
/// rounding; it is that of a standard deviation of 10⁶.
inline constexpr double kMinInformation = 1e-12;

inline constexpr double kMinRejectedDamping = 1e-6;  ///< minimum damping after a rejected step
inline constexpr double kUndamped = 1e-4;            ///< maximum damping of a step that counts as undamped
inline constexpr double kCovarianceDamping = 1e-10;  ///< more would change the covariance visibly

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
  Damping damping_;
  double predicted_ = 0;
  bool damped_ = true;  // also true without a factor
  bool moved_ = false;
  Eigen::VectorXd gradient_, hessian_, scale_, shift_, step_, trial_gradient_, trial_hessian_, next_;
};

}  // namespace tandem::detail
