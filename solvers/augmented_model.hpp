#pragma once

#include <array>
#include <limits>
#include <string>

#include <tandem/solvers/augmented_term.hpp>
#include <tandem/solvers/best_point.hpp>
#include <tandem/solvers/soft_model.hpp>

namespace tandem::detail {

/// What damped steps minimise under hard constraints and soft bounds that are rows: the augmented Lagrangian F + ψ
/// (solvers/augmented_term.hpp), by a convex piecewise quadratic model about X̄; and how multipliers and weights follow the
/// iterates.
class AugmentedModel final : public SoftModel {
 public:
  /// The weights start at `penalty` times the cost's own stiffness.
  AugmentedModel(Program& program, Session& session, const LevenbergMarquardtOptions& options, double penalty);

  /// From now on the model's Hessian is Gauss-Newton's and, besides, what that lacks of the Lagrangian's exact one at X̄, by
  /// the multipliers of the last step: evaluated once, kept over the steps that follow but for lessen_curvature(). It costs
  /// a few linearisations.
  void add_curvature();
  bool has_curvature() const { return curvature_share_ > 0.0; }
  /// What a filter weighs against each other: the cost, and how far the hard constraints are violated, √Σ w⁰ᵢ vᵢ²
  /// [standard deviations]. At X̄ and at the program's point, where merit_at_step() was the last to go.
  struct Progress {
    double cost, violation;
  };
  Progress progress() const { return {session_.summary.cost, term_.violation_size()}; }
  Progress progress_at_step() const { return {trial_cost_, term_.violation_size_at_point()}; }
  /// What the cost changes by along the step, to first order.
  double cost_slope() const { return gradient_.dot(step_); }
  /// Takes `step` in place of the model's own.
  void set_step(const Eigen::VectorXd& step) { step_ = step; }
  /// From now on merit() has nothing but the cost and the violation, weighted.
  void drop_multipliers();
  /// From now on find_step() begins with the rows active that the multipliers foresee, and ends where another set of them
  /// gains little: for who linearises anew after each step.
  void use_inexact_steps() { inexact_steps_ = true; }
  void restart(double penalty) override;

  double linearize() override;
  std::string not_finite() override;
  double gradient_size() override;
  bool find_step(double damping) override;
  double merit() const override { return session_.summary.cost + term_.value(); }
  double merit_at_step(bool with_derivatives) override;
  double merit_at_corrected_step(double damping) override;
  void drop_correction() override { term_.drop_correction(); }
  void learn() override;
  void forget_curvature() override { lagrangian_secant_.clear(); }

  bool constrained() const override { return constrained_; }
  Program::Violation violation() const override { return violation_; }
  void begin() override;
  void choose_hessian(bool strongly_damped, bool free) override;
  bool lessen_curvature() override;
  void estimate_multipliers() override { term_.estimate(next_multipliers_); }
  void estimate_multipliers_at_step() override;
  double optimality() override;
  void take_multipliers() override;
  void update_multipliers(double ratio) override;
  bool update_penalty(bool no_closer) override;
  bool relax_penalty() override;
  void begin_afresh() override { relaxed_ = stalled_ = 0; }
  bool locally_infeasible() override;
  void restore_best() override { restore(); }
  double best_cost() const override {
    return best_.violation <= best_.feasible ? best_.cost : std::numeric_limits<double>::infinity();
  }
  void leave_multipliers() override { program_.set_multipliers(next_multipliers_); }

 private:
  void linearize_constraints() override;
  void find_scale() override;
  void on_new_point() override;
  double best_fraction() const;
  double model_decrease() const;
  void set_penalty(double penalty);
  /// gradient = the Lagrangian's at X̄.
  void lagrangian_gradient(const Eigen::VectorXd& multipliers, Eigen::VectorXd& gradient) const;

  const LevenbergMarquardtOptions& options_;
  const bool constrained_;  // by hard rows, not soft bounds alone
  AugmentedTerm term_;
  SecantPairs<double> lagrangian_secant_;  // of the Lagrangian, in place of the cost's
  Program::Violation violation_{0.0, -1};
  BestPoint best_{kConstraintTolerance};
  double penalty_;
  double minimized_ = std::numeric_limits<double>::infinity();  // the gradient at the last classical update
  std::array<double, 5> recent_optimality_;                     // of the multipliers taken last
  int taken_ = 0, stalled_ = 0, relaxed_ = 0, strongly_damped_ = 0, free_ = 0;
  bool inexact_steps_ = false;
  bool exact_ = false;                                  // the curvature is added anew at each X̄
  Eigen::VectorXd curvature_;                           // what hessian_ lacks of the Lagrangian's exact one
  double curvature_share_ = 0.0;                        // that the model has of it
  Eigen::VectorXd augmented_hessian_, damped_hessian_;  // the second becomes the factor
  Eigen::VectorXd total_, last_lagrangian_, next_multipliers_, multipliers_here_;
  Eigen::VectorXd newton_step_;                    // to the model's minimum while the same rows are active
  Eigen::VectorXd hessian_step_, hessian_newton_;  // Hessian times step_ and newton_step_, by the equations they solve
};

}  // namespace tandem::detail
