#pragma once

#include <vector>

#include <tandem/problem/block_kernels.hpp>
#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::detail {

/// Augmented Lagrangian term of the hard constraints l ≤ c(x) ≤ u (Rockafellar 1973; Nocedal & Wright 2006, §17.4),
///
///      ψ(x) = ½ Σ wᵢ d(zᵢ)²,   zᵢ = cᵢ(x) + yᵢ/wᵢ,   d(z) = z − P[l,u](z),   ∇ψ = Jᵀ ŷ,   ŷᵢ = wᵢ d(zᵢ),
///
/// with multipliers y (positive at an upper bound, negative at a lower one) and weights w. The Gauss-Newton Hessian is
/// J_Aᵀ W J_A over the active rows A: the equalities, and the rows with zᵢ outside the bounds.
///
/// Weights are multiples of the stiffness of the cost along each row, wᵢ⁰ = (Jᵢ D⁻¹ Jᵢᵀ)⁻¹, where D is the diagonal of
/// the Hessian of the cost. The method is thus invariant to units. Rows of soft bounds (SoftBoundRole::as_rows) have
/// their own weights and no multipliers: for them ψ is the cost.
class AugmentedTerm {
 public:
  explicit AugmentedTerm(NlpEvaluator& nlp);

  /// Evaluates c and J at X̄.
  void linearize();
  /// Sets w⁰ from the curvature `scale` of each unknown, and y = 0.
  void start(const Eigen::VectorXd& scale);
  /// Sets the scale of each variable's unknowns to the largest diagonal entry of JᵀJ, J of the hard rows; 1 if they do
  /// not read the variable. For problems without cost.
  void find_scale(Eigen::VectorXd& scale) const;
  void set_penalty(double penalty) { w_ = penalty * stiffness_ + nlp_.soft_weights(); }

  void set_multipliers(const Eigen::VectorXd& y);
  /// Returns the updated multipliers ŷ at X̄.
  void estimate(Eigen::VectorXd& y) const { estimate_at(0.0, y); }
  /// Returns ŷ of the linear model at the step p.
  void estimate_at_step(Eigen::VectorXd& y) const { estimate_at(1.0, y); }

  /// ψ of the hard rows at X̄.
  double value() const { return value_of(c_); }
  /// Evaluates ψ of the hard rows at the point of the evaluator, on request with J.
  double value_at_point(bool with_derivatives);
  /// Cost of the soft bounds at X̄, and at the last point of value_at_point().
  double soft_value() const { return nlp_.cost_of_rows(c_); }
  double soft_value_at_point() const { return nlp_.cost_of_rows(trial_); }
  /// Overwrites the entries of soft bounds in y by the derivative of their cost with respect to c.
  void set_soft_multipliers(Eigen::VectorXd& y) const;
  /// Makes the point the new X̄. The last evaluation must have been there, with derivatives.
  void accept_point();
  /// g += Jᵀ y.
  void add_row_gradients(const Eigen::VectorXd& y, Eigen::VectorXd& g) const { add_transposed(y, g); }

  NlpEvaluator::Violation violation() const { return nlp_.violation(c_); }
  NlpEvaluator::Violation violation_at_point() const { return nlp_.violation(trial_); }
  /// Returns whether the rows at X̄ are met up to their row_tolerances() with this tolerance.
  bool is_met(double tolerance) const;
  /// Violation √Σ w⁰ᵢ vᵢ² at X̄, and at the last point of value_at_point().
  double violation_size() const { return violation_size_of(c_); }
  double violation_size_at_point() const { return violation_size_of(trial_); }
  /// Largest √w⁰ᵢ |cᵢ − P(cᵢ + yᵢ/w⁰ᵢ)|: the complementarity and feasibility residual [standard deviations].
  double complementarity(const Eigen::VectorXd& y) const;
  /// ‖D^-½ Jᵀ W⁰ v‖ / ‖W⁰^½ v‖ for the violations v: the slope of the violation. It is near 0 at a locally infeasible
  /// point.
  double infeasibility_slope(const Eigen::VectorXd& scale);
  /// Returns a row whose value or derivatives at X̄ are not finite, or −1.
  int nonfinite_row() const;

  /// Starts the minimisation of the model, in which c + J p replaces c, at p = 0. Finds the active rows there.
  /// set_segment() and advance() then move p.
  void begin_step();
  /// As begin_step(), but also activates the rows that the multipliers predict with the weights w⁰. With the much
  /// larger weights w, a curved row would leave the active set at each new X̄ and return within the step.
  void begin_step_with_predicted_rows();
  /// Replaces c by c(X̄ ⊕ s) − J s, which makes the model exact at s. The point of the evaluator must be X̄ ⊕ s.
  void correct(const Eigen::VectorXd& s);
  /// Restores c of X̄.
  void drop_correction();
  /// g += Jᵀ ŷ at p = 0, and H += J_Aᵀ W J_A, for the present active rows.
  void add_gradient(Eigen::VectorXd& g);
  void add_hessian(Eigen::VectorXd& hessian);
  /// Updates the Hessian of the last add_hessian() for the rows that have entered or left the active set.
  void change_hessian(Eigen::VectorXd& hessian);
  /// y += J_Aᵀ W J_A s.
  template <class S, class Y>
  void add_hessian_product(const S& s, Y&& y) {
    multiply(s, row_);
    row_.array() *= active_.array();
    add_transposed(row_, y);
  }
  /// Sets the segment from p to `next`, and adds Jᵀ ŷ at `next` for the present active rows to g.
  void set_segment(const Eigen::VectorXd& next, Eigen::VectorXd& g);
  /// Returns whether the active rows at the end of the segment are the present ones.
  bool same_active_rows_at_end() const;
  /// Slope of the model at a fraction of the segment.
  double slope(double fraction) const;
  /// Moves p by a fraction of the segment and updates the active rows.
  void advance(double fraction);
  double model_value() const;

 private:
  bool is_soft(Eigen::Index i) const { return nlp_.soft_weights()[i] > 0; }
  /// Distance of c + by from the bounds of row i: positive above, negative below, 0 within. Subtracts the bound from c
  /// first: with large weights, they are nearly equal, and `by` is as small as their rounding.
  double signed_violation(Eigen::Index i, double c, double by) const;
  double value_of(const Eigen::VectorXd& c) const;
  double violation_size_of(const Eigen::VectorXd& c) const;
  void estimate_at(double step, Eigen::VectorXd& y) const;
  /// Whether a row is active, and its active bound.
  struct RowState {
    bool active;
    double bound;
  };
  /// State of row i if c is replaced by c + by.
  RowState row_state(Eigen::Index i, double by) const;
  void activate();
  void activate(Eigen::Index i, double by);

  /// Entries of the Jacobian that are consecutive, in consecutive rows of one column.
  struct Column {
    int entry, row, rows, column;
  };
  template <class S>
  void multiply(const S& s, Eigen::VectorXd& rows) const {
    rows.setZero();
    for (const Column& c : columns_)
      with_size(c.rows, [&, J = jacobian_.data() + c.entry, to = rows.data() + c.row, x = s[c.column]](auto n) {
        for (int i = 0; i < n; ++i) to[i] += J[i] * x;
      });
  }
  template <class Y>
  void add_transposed(const Eigen::VectorXd& rows, Y&& y) const {
    for (const Column& c : columns_)
      with_size(c.rows, [&, J = jacobian_.data() + c.entry, from = rows.data() + c.row](auto n) {
        double sum = 0;
        for (int i = 0; i < n; ++i) sum += J[i] * from[i];
        y[c.column] += sum;
      });
  }

  NlpEvaluator& nlp_;
  Eigen::VectorXd c_, jacobian_, y_, w_, stiffness_;
  Eigen::VectorXd uncorrected_;  // c at X̄
  bool corrected_ = false;
  Eigen::VectorXd jacobian_step_, jacobian_segment_;  // J p, and J (next − p)
  // Weight of each active row, 0 for the others; bound of each active row.
  Eigen::VectorXd active_, bound_;
  Eigen::VectorXd in_hessian_;              // weights in the Hessian of add_hessian()
  Eigen::VectorXd trial_, trial_jacobian_;  // c and J at the point
  Eigen::VectorXd row_, tangent_;
  std::vector<Column> columns_;
};

}  // namespace tandem::detail
