#pragma once

#include <vector>

#include <tandem/problem/block_kernels.hpp>
#include <tandem/problem/program.hpp>

namespace tandem::detail {

/// The hard constraints l ≤ c(x) ≤ u as one term of an augmented Lagrangian (Rockafellar 1973; Nocedal & Wright 2006,
/// §17.4),
///
///     ψ(x) = ½ Σ wᵢ d(zᵢ)²,   zᵢ = cᵢ(x) + yᵢ/wᵢ,   d(z) = z − P[l,u](z),   ∇ψ = Jᵀ ŷ,   ŷᵢ = wᵢ d(zᵢ),
///
/// with multipliers y (above zero at an upper bound, below it at a lower one) and weights w. Its Gauss-Newton Hessian
/// is J_Aᵀ W J_A over the active rows A: the equalities, and those with zᵢ outside its bounds. Weights are multiples of
/// wᵢ⁰ = (Jᵢ D⁻¹ Jᵢᵀ)⁻¹, D the diagonal of the cost's Hessian: the stiffness that the cost has along the row, so that
/// units do not matter. Rows of soft bounds (SoftBounds::as_rows) have weights of their own and no multipliers: ψ is their
/// cost.
class AugmentedTerm {
 public:
  explicit AugmentedTerm(Program& program);

  /// c and J at X̄.
  void linearize();
  /// Sets w⁰ by the curvature `scale` of each unknown, y = 0.
  void start(const Eigen::VectorXd& scale);
  void set_penalty(double penalty) { w_ = penalty * stiffness_ + program_.soft_weights(); }

  void set_multipliers(const Eigen::VectorXd& y);
  /// ŷ at X̄, and at the step by the model below.
  void estimate(Eigen::VectorXd& y) const { estimate_at(0.0, y); }
  void estimate_at_step(Eigen::VectorXd& y) const { estimate_at(1.0, y); }

  /// ψ of the hard rows at X̄ and at the program's point.
  double value() const { return value_of(c_); }
  double value_at_point(bool with_derivatives);
  /// The same of soft bounds, at the point as value_at_point() was last asked for.
  double soft_value() const { return program_.cost_of_rows(c_); }
  double soft_value_at_point() const { return program_.cost_of_rows(trial_); }
  /// The derivative of soft bounds' cost by c takes its place in y.
  void set_soft_multipliers(Eigen::VectorXd& y) const;
  /// The program's point, evaluated last and with derivatives, has become X̄.
  void take_point();
  /// g += Jᵀ y.
  void add_row_gradients(const Eigen::VectorXd& y, Eigen::VectorXd& g) const { add_transposed(y, g); }

  Program::Violation violation() const { return program_.violation(c_); }
  /// √Σ w⁰ᵢ vᵢ² of the violations v: at X̄, and where value_at_point() was asked for last.
  double violation_size() const { return violation_size_of(c_); }
  double violation_size_at_point() const { return violation_size_of(trial_); }
  /// The largest √w⁰ᵢ |cᵢ − P(cᵢ + yᵢ/w⁰ᵢ)|: how far y and c are from complementarity and c from its bounds,
  /// in standard deviations.
  double complementarity(const Eigen::VectorXd& y) const;
  /// ‖D^-½ Jᵀ W⁰ v‖ / ‖W⁰^½ v‖ of the violations v, the gradient of their size: near 0 where no step lessens them.
  double infeasibility_slope(const Eigen::VectorXd& scale);
  /// A row whose value or derivatives are not finite at X̄, or −1.
  int row_not_finite() const;

  /// The term's model at a step p has c + J p in the place of c. Its least value is sought over p along segments:
  /// p = 0; the active rows are those there.
  void begin_step();
  /// The same, but that rows count as active, too, whose multipliers outweigh how far they are from their bounds by w⁰: by
  /// weights as stiff as w, a row that bends by more than y/w would drop out at every new X̄, and come back within the step.
  void begin_step_as_foreseen();
  /// c becomes c(X̄ ⊕ s) − J s, the program's point being X̄ ⊕ s: a model of the rows that is exact there; and X̄'s again.
  void correct(const Eigen::VectorXd& s);
  void drop_correction();
  /// g += Jᵀ ŷ at p = 0 and H += J_Aᵀ W J_A, as if the active rows were so for any p.
  void add_gradient(Eigen::VectorXd& g);
  void add_hessian(Eigen::VectorXd& hessian);
  /// The same for the Hessian that add_hessian() was last called with: by the rows alone that are active since, or no longer.
  void change_hessian(Eigen::VectorXd& hessian);
  /// y += J_Aᵀ W J_A s.
  template <class S, class Y>
  void add_hessian_product(const S& s, Y&& y) {
    multiply(s, row_);
    row_.array() *= active_.array();
    add_transposed(row_, y);
  }
  /// The segment from p to `next`; adds Jᵀ ŷ there for the same active rows.
  void set_segment(const Eigen::VectorXd& next, Eigen::VectorXd& g);
  /// Whether the active rows at its end are the same.
  bool same_active_rows_at_end() const;
  /// The slope of the model at a fraction of the segment.
  double slope(double fraction) const;
  /// p moves by a fraction of the segment, the active rows with it.
  void advance(double fraction);
  double model_value() const;

 private:
  bool is_soft(Eigen::Index i) const { return program_.soft_weights()[i] > 0; }
  /// How far c + by is outside of row i's bounds: first c, which is close to one where weights are large, and `by` is of the
  /// order of its rounding there.
  double outside(Eigen::Index i, double c, double by) const;
  double value_of(const Eigen::VectorXd& c) const;
  double violation_size_of(const Eigen::VectorXd& c) const;
  void estimate_at(double step, Eigen::VectorXd& y) const;
  /// Whether a row is active, and the bound that it is held to then.
  struct Holding {
    bool active;
    double bound;
  };
  /// Of row i with c + by in the place of c, as of outside().
  Holding holding(Eigen::Index i, double by) const;
  void activate();
  void activate(Eigen::Index i, double by);

  /// Consecutive entries of the Jacobian, of consecutive rows in one column.
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

  Program& program_;
  Eigen::VectorXd c_, jacobian_, y_, w_, stiffness_;
  Eigen::VectorXd uncorrected_;  // c at X̄
  bool corrected_ = false;
  Eigen::VectorXd jacobian_step_, jacobian_segment_;  // J p, and J (next − p)
  Eigen::VectorXd active_, bound_;  // weights of the active rows, 0 of the others; the bound that each is held to
  Eigen::VectorXd in_hessian_;      // the weights that add_hessian() took
  Eigen::VectorXd trial_, trial_jacobian_;  // at the point
  Eigen::VectorXd row_, tangent_;
  std::vector<Column> columns_;
};

}  // namespace tandem::detail
