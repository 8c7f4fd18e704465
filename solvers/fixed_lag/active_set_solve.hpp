#pragma once

#include <vector>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/active_rows.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag_options.hpp>
#include <tandem/solvers/fixed_lag/window_damping.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

/// Sequential quadratic programming for hard constraints and a good initial guess, with a warm-started active set.
///
/// Each step minimises the Gauss-Newton model of the cost under the linearised active rows (ActiveRows). The active set
/// starts from the multipliers of the problem. Rows with a multiplier of the wrong sign leave it, and rows that the
/// step would violate enter it, until it is that of the model's solution (Hintermüller, Ito & Kunisch 2002, The
/// primal-dual active set strategy). If it does not change, a step needs one factorisation, as without constraints.
///
/// Each step is corrected for the curvature of the active rows, with the factor at hand. Steps that do not reduce the ℓ1
/// merit function, corrected or not, are damped as by Levenberg and Marquardt. Unobservable directions, such as the
/// heading of a target of which only positions are measured, are damped from the start. The method ends after
/// max_iterations if the constraints hold then.
///
/// It gives up if the linearised rows contradict each other, if the active set cycles, or if neither damping nor ten
/// times max_iterations give a solution. The caller then uses a globally convergent solver, from the point reached.
class ActiveSetSolve {
 public:
  /// `cholesky` must have the Hessian pattern of `nlp`. It has the last factor afterwards, and `rows` its active rows.
  ActiveSetSolve(NlpEvaluator& nlp, BlockCholesky& cholesky, ActiveRows& rows, const FixedLagOptions& options);

  /// Solves the problem, and stores the multipliers if it converges.
  Summary run();
  /// Returns whether the method gave up. The summary then has the status max_iterations.
  bool gave_up() const { return gave_up_; }
  /// Returns whether the factor contains damping, or is missing.
  bool damped() const { return damped_; }

 private:
  double linearize();
  void iterate();
  bool find_step();
  bool factorize();
  struct Change {
    ActiveRows::Side side;
    double by;  // wrong multiplier or violation [standard deviations]
  };
  Change change_of(Eigen::Index row) const;
  bool must_change_active_set();
  void change_active_set(bool all);
  void drop_wrong_signs();
  void bounds_minus(const Eigen::VectorXd& c, Eigen::VectorXd& b) const;
  /// Largest violation relative to the tolerance of its row; above 1 if a row is violated.
  NlpEvaluator::Violation violation(const Eigen::VectorXd& c) const { return relative_violation(nlp_, c, tolerances_); }
  double penalised_violation(const Eigen::VectorXd& c) const;
  double merit_at_step();
  bool try_step();
  bool correct_step();
  double remaining_gain();
  bool give_up();

  const FixedLagOptions& options_;
  NlpEvaluator& nlp_;
  BlockCholesky& cholesky_;
  ActiveRows& rows_;
  Session session_;
  std::vector<ActiveRows::Side> sides_;
  WindowDamping damping_;
  double predicted_ = 0, trial_cost_ = 0;
  bool damped_ = true, gave_up_ = false;
  Eigen::VectorXd gradient_, hessian_, scale_, shift_, step_, trial_gradient_, augmented_;
  Eigen::VectorXd c_, jacobian_, trial_c_, trial_jacobian_, y_, b_, errors_, of_step_, penalty_;
  Eigen::VectorXd tolerances_;  // on the violation of each row
};

}  // namespace tandem::detail
