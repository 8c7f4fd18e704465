#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>

#include <tandem/solvers/augmented_term.hpp>
#include <tandem/solvers/best_point.hpp>
#include <tandem/solvers/soft_model.hpp>

namespace tandem::detail {

/// Merit function and step model of problems with hard constraints or with soft bounds that are rows.
///
/// The merit function is the augmented Lagrangian F + ψ (solvers/augmented_term.hpp). Its model about X̄ is a convex
/// piecewise quadratic. The class also updates the multipliers and the penalty from step to step.
class AugmentedModel final : public SoftModel {
 public:
  /// `penalty` is the initial penalty, as a multiple of the stiffness of the cost along each row.
  AugmentedModel(NlpEvaluator& nlp, Session& session, const LevenbergMarquardtOptions& options, double penalty);

  /// Adds the exact curvature of the Lagrangian at X̄ to the Gauss-Newton Hessian. Uses the multipliers of the last
  /// step. The curvature is evaluated once, which costs as much as a few linearisations, and kept until
  /// reduce_curvature().
  void add_curvature();
  bool has_curvature() const { return curvature_share_ > 0.0; }
  /// The two measures that a filter weighs: the cost, and the violation √Σ w⁰ᵢ vᵢ² of the hard constraints [standard
  /// deviations].
  struct Progress {
    double cost, violation;
  };
  Progress progress() const { return {session_.summary.cost, term_.violation_size()}; }
  /// Returns the measures at the step, for which merit_at_step() has been called.
  Progress progress_at_step() const { return {trial_cost_, term_.violation_size_at_point()}; }
  /// First-order change of the cost along the step.
  double cost_slope() const { return gradient_.dot(step_); }
  void set_step(const Eigen::VectorXd& step) { step_ = step; }
  /// Sets the multipliers to zero: merit() is then the cost plus the penalised violation.
  void drop_multipliers();
  /// Makes find_step() start from the active set that the multipliers predict, and end if a new active set gains
  /// little. For callers that linearise after each step.
  void use_inexact_steps() { inexact_steps_ = true; }
  void restart(double penalty) override;

  double linearize() override;
  std::string nonfinite_block() override;
  double gradient_size() override;
  bool find_step(double damping) override;
  double merit() const override { return session_.summary.cost + term_.value(); }
  double merit_at_step(bool with_derivatives) override;
  double merit_at_corrected_step(double damping) override;
  void drop_correction() override { term_.drop_correction(); }
  void add_secant_pair() override;
  void clear_curvature() override { lagrangian_secant_.clear(); }

  bool constrained() const override { return constrained_; }
  NlpEvaluator::Violation violation() const override { return violation_; }
  double violation_at_step() const override { return term_.violation_at_point().size; }
  bool feasible() override;
  /// Returns whether no row at X̄ is violated by more than `tolerance` and its rounding error.
  bool meets(double tolerance) const { return violation_.size <= tolerance || term_.is_met(tolerance); }
  void begin() override;
  void begin_after_restoration() override;
  void choose_hessian(const StepQuality& quality) override;
  bool reduce_curvature() override;
  void estimate_multipliers() override { term_.estimate(next_multipliers_); }
  void estimate_multipliers_at_step() override;
  double optimality() override;
  void accept_multipliers() override;
  void update_multipliers(double ratio) override;
  bool update_penalty(bool no_closer) override;
  bool relax_penalty() override;
  void reset_penalty_counters() override { relaxed_ = stalled_ = 0; }
  /// Returns whether no small step reduces the violation of the constraints.
  bool locally_infeasible();
  void restore_best() override { restore(); }
  bool is_solution(double tolerance) override;
  double best_cost() const override {
    return best_.violation <= best_.feasible ? best_.cost : std::numeric_limits<double>::infinity();
  }
  void store_multipliers() override { nlp_.set_multipliers(next_multipliers_); }

 private:
  void linearize_constraints() override;
  void start();
  void find_scale() override;
  void on_new_point() override;
  double best_fraction() const;
  double model_decrease() const;
  void set_penalty(double penalty);
  void lagrangian_gradient(const Eigen::VectorXd& multipliers, Eigen::VectorXd& gradient) const;

  const LevenbergMarquardtOptions& options_;
  const bool constrained_;  // there are hard rows, not only soft bounds
  AugmentedTerm term_;
  SecantPairs<double> lagrangian_secant_;  // secant pairs of the Lagrangian; replace secant_, those of the cost
  NlpEvaluator::Violation violation_{0.0, -1};
  bool flat_cost_ = false;             // the cost curves no unknown
  bool falling_ = false;               // the violation falls fast: it is not rounding yet
  std::optional<bool> only_rounding_;  // whether the violation is within row_tolerances(), once known
  BestPoint best_{kConstraintTolerance};
  double penalty_;
  double minimized_ = std::numeric_limits<double>::infinity();  // gradient size at the last classical multiplier update
  std::array<double, 5> recent_optimality_;                     // residuals at the last accepted multipliers
  int taken_ = 0, stalled_ = 0, relaxed_ = 0, strongly_damped_ = 0, undamped_ = 0;
  bool inexact_steps_ = false;
  bool exact_ = false;                                  // the curvature is evaluated at each X̄
  Eigen::VectorXd curvature_;                           // exact Hessian of the Lagrangian minus hessian_
  double curvature_share_ = 0.0;                        // fraction of curvature_ in the model
  Eigen::VectorXd augmented_hessian_, damped_hessian_;  // damped_hessian_ is overwritten by its factor
  Eigen::VectorXd total_, last_lagrangian_, next_multipliers_, multipliers_here_;
  Eigen::VectorXd newton_step_;                    // minimiser of the model for a fixed active set
  Eigen::VectorXd hessian_step_, hessian_newton_;  // products of the Hessian with step_ and newton_step_
};

}  // namespace tandem::detail
