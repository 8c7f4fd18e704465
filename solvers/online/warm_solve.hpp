#pragma once

#include <tandem/problem/program.hpp>
#include <tandem/solvers/damped_step.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/online/fixed_lag_options.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

/// Of an unknown that nothing observes, or of the diagonal where that is combinations of unknowns, such as the heading of a target
/// of which only positions are measured: far above rounding, and a standard deviation of a million.
inline constexpr double kLeastInformation = 1e-12;

/// Levenberg–Marquardt for a problem of soft residuals that is nearly solved when it begins and done after a step or
/// two: what costs no less than a step (observability, curvature learned from past steps, a last linearisation) is left
/// out.
class WarmSolve {
 public:
  /// `cholesky`: of the program's Hessian pattern; holds the factor afterwards.
  WarmSolve(Program& program, BlockCholesky& cholesky, const FixedLagOptions& options);

  Summary run();
  /// Whether the factor is not that of the problem itself.
  bool damped() const { return damped_; }

 private:
  double linearize();
  void iterate();
  bool find_step();
  bool factorize();
  /// What is evaluated together with a step's cost.
  enum class With { nothing, gradient, hessian };
  double cost_at_step(With with);
  void try_step();
  void accept(double cost);
  double left_to_gain();

  const FixedLagOptions& options_;
  Program& program_;
  BlockCholesky& cholesky_;
  Session session_;
  Damping damping_;
  double predicted_ = 0;
  bool damped_ = true;  // also before there is a factor
  Eigen::VectorXd gradient_, hessian_, scale_, shift_, step_, trial_gradient_, trial_hessian_, next_;
};

}  // namespace tandem::detail
