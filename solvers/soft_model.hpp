#pragma once

#include <limits>
#include <string>
#include <utility>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/levenberg_marquardt.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/observability.hpp>
#include <tandem/solvers/secant.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

/// Merit function and step model of the damped steps without hard constraints.
///
/// The merit function is the cost. Its model about X̄ is F + gᵀp + ½ pᵀHp. H is the Gauss-Newton Hessian with the
/// curvature of the secant pairs or, if that predicts steps badly, the exact Hessian. The summary of the session has the
/// cost at X̄; evaluations and their times are added to it.
class SoftModel {
 public:
  SoftModel(NlpEvaluator& nlp, Session& session, const LevenbergMarquardtOptions& options,
            bool with_constraints = false);
  virtual ~SoftModel() = default;

  /// Prepares another solve of the same problem; keeps the memory.
  virtual void restart(double /*penalty*/) { clear_curvature(); }
  /// Evaluates the derivatives at X̄ and returns the cost. Must be called first. Throws Error if a residual is
  /// undefined.
  virtual double linearize();
  /// Returns the name of a block whose derivatives at X̄ are not finite, or an empty string.
  virtual std::string nonfinite_block();
  /// Largest entry of the gradient of the merit function at X̄, scaled to unit curvature of each unknown.
  virtual double gradient_size() { return scaled(gradient_); }

  /// Gain at X̄ of the unknowns that even a small damping stops, because other unknowns of the same variable have far
  /// more curvature: one standard deviation is 1e5 times another.
  double hidden_gain(double damping) const;

  /// Computes the damped step from X̄ and its predicted gain. Returns false if the damped Hessian is not positive
  /// definite.
  virtual bool find_step(double damping);
  const Eigen::VectorXd& step() const { return step_; }
  /// Largest entry of the step.
  double step_size() const;
  double predicted() const { return predicted_; }
  virtual double merit() const { return session_.summary.cost; }
  /// Merit function after the step; infinite where it is undefined. With `with_derivatives`, also evaluates the
  /// derivatives of the cost there, which is cheaper than a later evaluation.
  virtual double merit_at_step(bool with_derivatives);
  /// Merit function after a second-order correction of a rejected step, for curved hard constraints. Infinite without
  /// hard constraints. predicted() is unchanged. Call drop_correction() if the corrected step is rejected too.
  virtual double merit_at_corrected_step(double /*damping*/) { return std::numeric_limits<double>::infinity(); }
  virtual void drop_correction() {}
  /// Moves X̄ to the end of the step without derivatives. For the last step only.
  void move();
  /// Moves X̄ to the end of the step and evaluates the derivatives there. Returns false and moves back if they are
  /// undefined.
  bool move_on();
  virtual void add_secant_pair();
  virtual void clear_curvature() { secant_.clear(); }
  /// Memory that the rank analysis may overwrite after the last step.
  Workspace workspace() { return {cholesky_, gradient_, hessian_, std::exchange(hessian_is_current_, false)}; }

  // Whether there are hard constraints, and their violation.

  virtual bool constrained() const { return false; }
  virtual NlpEvaluator::Violation violation() const { return {0.0, -1}; }
  /// Violation at the step, for which merit_at_step() has been called.
  virtual double violation_at_step() const { return 0.0; }
  /// Returns whether all hard constraints are met up to their tolerances.
  virtual bool feasible() { return true; }
  /// Called before the first step, once the initial guess is known to be finite.
  virtual void begin() {}
  /// Quality of the last steps, for choose_hessian().
  struct StepQuality {
    bool strongly_damped = false, undamped = false;  ///< damping of the next step
    bool underestimated = false;                     ///< near a minimum, the last step gained more than predicted
    bool rejected = false;                           ///< near a minimum, the last step was rejected
  };
  /// Called before each step: selects the Gauss-Newton or the exact Hessian.
  virtual void choose_hessian(const StepQuality& quality);
  /// Uses the Gauss-Newton Hessian from now on. Returns false if it was in use.
  bool abandon_exact_hessian();
  /// Reduces the curvature beyond Gauss-Newton, finally to none. For a Hessian that is not positive definite. Returns
  /// false if there was none.
  virtual bool reduce_curvature() { return false; }
  /// Computes the multipliers of the first-order update at X̄.
  virtual void estimate_multipliers() {}
  /// Computes the multipliers at the minimum of the model.
  virtual void estimate_multipliers_at_step() {}
  /// Residual of the first-order conditions at X̄ with the last multipliers [standard deviations]. 0 without hard
  /// constraints; the gradient and the predicted gain are sufficient there.
  virtual double optimality() { return 0.0; }
  /// Accepts the last multipliers, and increases a small penalty.
  virtual void accept_multipliers() {}
  /// Accepts the last multipliers after a step with the acceptance ratio `ratio` if they reduce the optimality
  /// residual. Otherwise uses the multipliers of the classical method, once the augmented Lagrangian is minimised.
  virtual void update_multipliers(double /*ratio*/) {}
  /// Increases the penalty if the violation has stalled. Returns true if the constraints are locally infeasible.
  virtual bool update_penalty(bool /*stalled*/) { return false; }
  /// Reduces the penalty after many rejected steps: with a large penalty, a slightly curved row causes rejections.
  /// Returns false if the penalty is not above its usual value, or after too many reductions.
  virtual bool relax_penalty() { return false; }
  /// Resets the counters of penalty updates. For use after a long step.
  virtual void reset_penalty_counters() {}
  /// Called after linearize() at a point that is new because minimize_violation() has moved X̄ there.
  virtual void begin_after_restoration() {}
  /// Moves X̄ to the point that the evaluator has saved.
  void restore() {
    hessian_is_current_ = false;
    nlp_.restore();
  }
  virtual void restore_best() {}
  /// Returns whether X̄ satisfies hard constraints and the first-order conditions with other multipliers, which then
  /// become the last ones. Those of the augmented Lagrangian diverge if gradients of active constraints vanish or nearly
  /// depend on each other.
  virtual bool is_solution(double /*tolerance*/) { return false; }
  /// Cost of the best feasible point.
  virtual double best_cost() const { return std::numeric_limits<double>::infinity(); }
  /// Stores the last multipliers in the hard blocks of the problem.
  virtual void store_multipliers() {}

 protected:
  /// Evaluates the constraints and their derivatives at X̄. The derivatives of the cost are in trial_gradient_ and
  /// hessian_.
  virtual void linearize_constraints() {}
  /// Evaluates the Hessian at X̄ again if the factor has overwritten it and the step was rejected. This is rare, and
  /// one matrix needs half the memory of two.
  void restore_hessian();
  /// Sets scale_ to the diagonal of the Hessian at X̄.
  virtual void find_scale();
  /// Called when X̄ and all its derivatives are new.
  virtual void on_new_point() {}
  /// Adds the damping to the diagonal of a Hessian, in place or in a copy.
  void damp(const Eigen::VectorXd& hessian, double damping, Eigen::VectorXd& damped) const;
  /// Calls f(begin, size) for the values of each block column, in the tasks that write them.
  template <class F>
  void each_block_column(F f) const {
    const SymmetricPattern& pattern = nlp_.hessian_pattern();
    blocks_.each([&](int, Eigen::Index first, Eigen::Index blocks) {
      for (int k = int(first); k < first + blocks; ++k)
        f(Eigen::Index(pattern.value_start[std::size_t(k)]), Eigen::Index(pattern.height(k)) * pattern.width(k));
    });
  }
  double scaled(const Eigen::VectorXd& gradient) const;
  BlockCholesky compile();

  NlpEvaluator& nlp_;
  Session& session_;
  ChunkedLoop parts_, blocks_;  // over the unknowns, and over the block columns of the Hessian
  Eigen::VectorXd gradient_, trial_gradient_;
  Eigen::VectorXd hessian_;        // Gauss-Newton Hessian at X̄, or a factor, or that Hessian at the last trial point
  Eigen::VectorXd exact_hessian_;  // exact Hessian at X̄; empty until it is used
  bool exact_allowed_ = true, use_exact_ = false, exact_is_current_ = false;
  int rejected_ = 0, damped_ = 0;  // consecutive steps
  bool hessian_is_current_ = false;
  Eigen::VectorXd last_gradient_;  // gradient at the previous X̄
  Eigen::VectorXd scale_;          // curvature of each unknown
  Eigen::VectorXd step_;
  BlockCholesky cholesky_;  // declared after the members that compile() sets
  SecantPairs<float> secant_;
  double predicted_ = 0, trial_cost_ = 0;
  bool trial_has_derivatives_ = false;
  bool all_curved_ = false;  // each diagonal entry of the Hessian is positive
};

}  // namespace tandem::detail
