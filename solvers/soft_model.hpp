#pragma once

#include <limits>
#include <string>
#include <utility>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/levenberg_marquardt.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/observability.hpp>
#include <tandem/solvers/secant.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

/// What damped steps minimise: the cost, by its Gauss-Newton model F + gᵀp + ½ pᵀHp about X̄ with the curvature that
/// secants have shown. The summary's cost is that of X̄, and each evaluation and its time are counted there.
class SoftModel {
 public:
  SoftModel(Program& program, Session& session, const LevenbergMarquardtOptions& options,
            bool with_constraints = false);
  virtual ~SoftModel() = default;

  /// As if it were new, but for what it has in memory: for another solve of the same program.
  virtual void restart(double /*penalty*/) { forget_curvature(); }
  /// Derivatives at X̄, and the cost. Called before anything else; throws Error where a residual is undefined.
  virtual double linearize();
  /// Names the block whose derivatives at X̄ are not finite; empty when all are.
  virtual std::string not_finite();
  /// Largest entry of what is minimised's gradient at X̄, in units in which each unknown has unit curvature.
  virtual double gradient_size() { return scaled(gradient_); }

  /// The damped step from X̄ and what it gains by the model. False when the damped Hessian is not positive definite.
  virtual bool find_step(double damping);
  const Eigen::VectorXd& step() const { return step_; }
  /// Its largest entry.
  double step_size() const;
  double predicted() const { return predicted_; }
  /// What is minimised, at X̄ and after the step, infinite where it is undefined. `with_derivatives` evaluates the
  /// cost's there at once, which costs less than later.
  virtual double merit() const { return session_.summary.cost; }
  virtual double merit_at_step(bool with_derivatives);
  /// The same after a step that is corrected by how the hard constraints bend along the one that was refused; infinite
  /// where there are none. What it gains by the model stays what it was. drop_correction() where it is refused as well.
  virtual double merit_at_corrected_step(double /*damping*/) { return std::numeric_limits<double>::infinity(); }
  virtual void drop_correction() {}
  /// X̄ is where the step leads from now on, without derivatives: the last step of all.
  void move();
  /// The same with them. False, and back again, where a residual's derivatives are undefined.
  bool move_on();
  /// Learns curvature from the step that was taken.
  virtual void learn();
  virtual void forget_curvature() { secant_.clear(); }
  /// For what comes after the last step.
  Workspace workspace() { return {cholesky_, gradient_, hessian_, std::exchange(hessian_is_here_, false)}; }

  // Of the hard constraints, where there are any.

  virtual bool constrained() const { return false; }
  virtual Program::Violation violation() const { return {0.0, -1}; }
  bool feasible() const { return violation().size <= kConstraintTolerance; }
  /// Before the first step, once the start is known to be finite.
  virtual void begin() {}
  /// Before each step: whether the Hessian is to be Gauss-Newton's or the Lagrangian's exact one.
  virtual void choose_hessian(bool /*strongly_damped*/, bool /*free*/) {}
  /// Keeps less of what the Hessian has besides Gauss-Newton's, in the end nothing: for one that is not positive definite.
  /// False where there was nothing.
  virtual bool lessen_curvature() { return false; }
  /// Multipliers for what follows: those of the first-order update at X̄, or of the model's minimum at the step.
  virtual void estimate_multipliers() {}
  virtual void estimate_multipliers_at_step() {}
  /// Residual of the first-order conditions at X̄ with these, in standard deviations. 0 without hard constraints, where
  /// the gradient and what a step gains say it all.
  virtual double optimality() { return 0.0; }
  /// Takes them, with more weight on the constraints while that is small.
  virtual void take_multipliers() {}
  /// Takes them after a step that gained `ratio` of what the model foretold, while they bring the optimality conditions
  /// closer; else those of the classical method, once the augmented Lagrangian is minimised.
  virtual void update_multipliers(double /*ratio*/) {}
  /// Where the constraints come no closer, they get more weight. True when they are to be given up.
  virtual bool update_penalty(bool /*no_closer*/) { return false; }
  /// Where steps are refused again and again, less weight, for which less of a bend in a row is too much. False when they
  /// have no more than is usual, or it was done too often.
  virtual bool relax_penalty() { return false; }
  /// X̄ is far from where it was: what was counted there of weights raised and relaxed is forgotten.
  virtual void begin_afresh() {}
  /// Whether no small step lessens the constraints' violation, whatever it costs.
  virtual bool locally_infeasible() { return false; }
  /// X̄ becomes what the program keeps.
  void restore() {
    hessian_is_here_ = false;
    program_.restore();
  }
  /// X̄ becomes the best point so far.
  virtual void restore_best() {}
  /// The cost of the best feasible one.
  virtual double best_cost() const { return std::numeric_limits<double>::infinity(); }
  /// The problem's hard blocks get the last multipliers.
  virtual void leave_multipliers() {}

 protected:
  /// Derivatives besides the cost's at X̄, the cost's own being in trial_gradient_ and hessian_.
  virtual void linearize_constraints() {}
  /// The Hessian is the one at X̄ again, where the factor took its place, and then a step was refused: rarely, and one of
  /// them takes half the memory of two.
  void bring_hessian_here();
  /// Sets scale_ by the Hessian at X̄.
  virtual void find_scale();
  /// What there is to do where X̄ and all its derivatives are new.
  virtual void on_new_point() {}
  /// What is factorised for a damped step: a Hessian, in its place or copied, with more on its diagonal.
  void damp(const Eigen::VectorXd& hessian, double damping, Eigen::VectorXd& damped) const;
  /// f(begin, size) of the values of each block column, in the lanes that write them.
  template <class F>
  void each_block_column(F f) const {
    const SymmetricPattern& pattern = program_.hessian_pattern();
    blocks_.each([&](int, Eigen::Index first, Eigen::Index blocks) {
      for (int k = int(first); k < first + blocks; ++k)
        f(Eigen::Index(pattern.value_start[std::size_t(k)]), Eigen::Index(pattern.height(k)) * pattern.width(k));
    });
  }
  double scaled(const Eigen::VectorXd& gradient) const;
  BlockCholesky compile();

  Program& program_;
  Session& session_;
  LaneParts parts_, blocks_;  // of the unknowns, and of the Hessian's blocks
  Eigen::VectorXd gradient_, trial_gradient_;
  Eigen::VectorXd hessian_;  // at X̄, or the factor there, or where the last step led
  bool hessian_is_here_ = false;
  Eigen::VectorXd last_gradient_;  // at the last X̄
  Eigen::VectorXd scale_;          // curvature of each unknown
  Eigen::VectorXd step_;
  BlockCholesky cholesky_;  // after what is made with it
  SecantPairs<float> secant_;
  double predicted_ = 0, trial_cost_ = 0;
  bool trial_has_derivatives_ = false;
  bool all_curved_ = false;  // each unknown, by the Hessian's diagonal
};

}  // namespace tandem::detail
