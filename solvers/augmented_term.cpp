#include <algorithm>
#include <cmath>

#include <tandem/solvers/augmented_term.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

AugmentedTerm::AugmentedTerm(NlpEvaluator& nlp) : nlp_(nlp) {
  const int rows = nlp.num_rows();
  for (Eigen::VectorXd* v : {&c_, &y_, &w_, &stiffness_, &jacobian_step_, &jacobian_segment_, &active_, &bound_,
                             &in_hessian_, &trial_, &row_, &uncorrected_})
    v->setZero(rows);
  for (Eigen::VectorXd* v : {&jacobian_, &trial_jacobian_})
    v->setZero(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size()));
  tangent_.setZero(nlp.num_unknowns());
  const auto& pattern = nlp.jacobian_pattern();
  for (int k = 0; k < static_cast<int>(pattern.row.size()); ++k) {
    const int row = pattern.row[std::size_t(k)], column = pattern.column[std::size_t(k)];
    if (!columns_.empty() && columns_.back().column == column && columns_.back().row + columns_.back().rows == row)
      ++columns_.back().rows;
    else
      columns_.push_back({k, row, 1, column});
  }
}

void AugmentedTerm::linearize() {
  nlp_.linearize_constraints(c_, jacobian_);
  corrected_ = false;
}

void AugmentedTerm::accept_point() {
  c_.swap(trial_);
  jacobian_.swap(trial_jacobian_);
  corrected_ = false;
}

void AugmentedTerm::start(const Eigen::VectorXd& scale) {
  const double least = min_curvature(scale);
  const auto& pattern = nlp_.jacobian_pattern();
  stiffness_.setZero();
  for (std::size_t k = 0; k < pattern.row.size(); ++k) {
    const double J = jacobian_[Eigen::Index(k)];
    stiffness_[pattern.row[k]] += J * J / std::max(scale[pattern.column[k]], least);
  }
  for (Eigen::Index i = 0; i < stiffness_.size(); ++i)
    stiffness_[i] = is_soft(i) ? 0.0 : stiffness_[i] > 0 ? 1.0 / stiffness_[i] : 1.0;
  y_.setZero();
}

void AugmentedTerm::find_scale(Eigen::VectorXd& scale) const {
  const TripletPattern& entries = nlp_.jacobian_pattern();
  scale.setZero();
  for (std::size_t k = 0; k < entries.row.size(); ++k)
    if (!is_soft(entries.row[k])) scale[entries.column[k]] += jacobian_[Eigen::Index(k)] * jacobian_[Eigen::Index(k)];
  const SymmetricPattern& pattern = nlp_.hessian_pattern();
  for (int b = 0; b < pattern.num_blocks(); ++b) {
    auto unknowns = scale.segment(pattern.first[std::size_t(b)], pattern.width(b));
    const double largest = unknowns.maxCoeff();
    unknowns.setConstant(largest > 0 ? largest : 1.0);
  }
}

void AugmentedTerm::set_multipliers(const Eigen::VectorXd& y) { y_ = (nlp_.soft_weights().array() > 0).select(0.0, y); }

void AugmentedTerm::set_soft_multipliers(Eigen::VectorXd& y) const {
  for (Eigen::Index i = 0; i < y.size(); ++i)
    if (is_soft(i)) y[i] = w_[i] * signed_violation(i, c_[i], 0.0);
}

double AugmentedTerm::signed_violation(Eigen::Index i, double c, double by) const {
  const double above = (c - nlp_.upper()[i]) + by, below = (c - nlp_.lower()[i]) + by;
  if (above > 0) return above;
  if (below < 0) return below;
  return above <= 0 && below >= 0 ? 0.0 : above + below;  // NaN
}

AugmentedTerm::RowState AugmentedTerm::row_state(Eigen::Index i, double by) const {
  const double d = signed_violation(i, c_[i], by), lower = nlp_.lower()[i], upper = nlp_.upper()[i];
  return {d != 0 || lower == upper, d < 0 ? lower : upper};
}

void AugmentedTerm::activate(Eigen::Index i, double by) {
  const RowState row = row_state(i, by);
  active_[i] = row.active ? w_[i] : 0.0;
  bound_[i] = row.bound;
}

void AugmentedTerm::estimate_at(double step, Eigen::VectorXd& y) const {
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    y[i] = w_[i] * signed_violation(i, c_[i], step * jacobian_step_[i] + y_[i] / w_[i]);
}

double AugmentedTerm::value_of(const Eigen::VectorXd& c) const {
  double total = 0;
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    if (is_soft(i)) continue;
    const double d = signed_violation(i, c[i], y_[i] / w_[i]);
    total += 0.5 * w_[i] * d * d;
  }
  return total;
}

bool AugmentedTerm::is_met(double tolerance) const {
  return relative_violation(nlp_, c_, row_tolerances(nlp_, jacobian_, tolerance)).size <= 1.0;
}

double AugmentedTerm::violation_size_of(const Eigen::VectorXd& c) const {
  double total = 0;
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    const double v = signed_violation(i, c[i], 0.0);
    total += stiffness_[i] * v * v;
  }
  return std::sqrt(total);
}

double AugmentedTerm::value_at_point(bool with_derivatives) {
  if (with_derivatives)
    nlp_.linearize_constraints_at_point(trial_, trial_jacobian_);
  else
    nlp_.constraints(trial_);
  return value_of(trial_);
}

double AugmentedTerm::complementarity(const Eigen::VectorXd& y) const {
  double largest = 0;
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    if (is_soft(i)) continue;
    const double projected = std::clamp(c_[i] + y[i] / stiffness_[i], nlp_.lower()[i], nlp_.upper()[i]);
    largest = std::max(largest, std::sqrt(stiffness_[i]) * std::abs(c_[i] - projected));
  }
  return largest;
}

double AugmentedTerm::infeasibility_slope(const Eigen::VectorXd& scale) {
  double size = 0;
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const double v = signed_violation(i, c_[i], 0.0);
    row_[i] = stiffness_[i] * v;
    size += stiffness_[i] * v * v;
  }
  if (!(size > 0)) return 0.0;
  tangent_.setZero();
  add_transposed(row_, tangent_);
  const double least = min_curvature(scale);
  double steepness = 0;
  for (Eigen::Index i = 0; i < scale.size(); ++i) steepness += tangent_[i] * tangent_[i] / std::max(scale[i], least);
  return std::sqrt(steepness / size);
}

int AugmentedTerm::nonfinite_row() const {
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    if (!std::isfinite(c_[i])) return static_cast<int>(i);
  for (Eigen::Index k = 0; k < jacobian_.size(); ++k)
    if (!std::isfinite(jacobian_[k])) return nlp_.jacobian_pattern().row[std::size_t(k)];
  return -1;
}

void AugmentedTerm::correct(const Eigen::VectorXd& s) {
  nlp_.constraints(trial_);
  multiply(s, row_);
  uncorrected_ = c_;
  c_ = trial_ - row_;
  corrected_ = true;
}

void AugmentedTerm::drop_correction() {
  if (corrected_) c_ = uncorrected_;
  corrected_ = false;
}

void AugmentedTerm::begin_step() {
  jacobian_step_.setZero();
  activate();
}

void AugmentedTerm::begin_step_with_predicted_rows() {
  begin_step();
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    if (active_[i] == 0 && y_[i] != 0) activate(i, y_[i] / stiffness_[i]);
  }
}

void AugmentedTerm::activate() {
  for (Eigen::Index i = 0; i < c_.size(); ++i) activate(i, jacobian_step_[i] + y_[i] / w_[i]);
}

void AugmentedTerm::add_gradient(Eigen::VectorXd& g) {
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    row_[i] = active_[i] > 0 ? active_[i] * (c_[i] - bound_[i]) + y_[i] : 0.0;
  add_transposed(row_, g);
}

void AugmentedTerm::add_hessian(Eigen::VectorXd& hessian) {
  in_hessian_ = active_;
  nlp_.add_constraint_hessian(active_, jacobian_, hessian);
}

void AugmentedTerm::change_hessian(Eigen::VectorXd& hessian) {
  row_ = active_ - in_hessian_;
  in_hessian_ = active_;
  nlp_.add_constraint_hessian(row_, jacobian_, hessian);
}

void AugmentedTerm::set_segment(const Eigen::VectorXd& next, Eigen::VectorXd& g) {
  multiply(next, jacobian_segment_);
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    row_[i] = active_[i] > 0 ? active_[i] * ((c_[i] - bound_[i]) + jacobian_segment_[i]) + y_[i] : 0.0;
  add_transposed(row_, g);
  jacobian_segment_ -= jacobian_step_;
}

bool AugmentedTerm::same_active_rows_at_end() const {
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const RowState row = row_state(i, jacobian_step_[i] + jacobian_segment_[i] + y_[i] / w_[i]);
    if (row.active != (active_[i] > 0)) return false;
    if (row.active && row.bound != bound_[i]) return false;
  }
  return true;
}

double AugmentedTerm::slope(double fraction) const {
  double total = 0;
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    total += w_[i] * signed_violation(i, c_[i], jacobian_step_[i] + fraction * jacobian_segment_[i] + y_[i] / w_[i]) *
             jacobian_segment_[i];
  return total;
}

void AugmentedTerm::advance(double fraction) {
  jacobian_step_ += fraction * jacobian_segment_;
  activate();
}

double AugmentedTerm::model_value() const {
  double total = 0;
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const double d = signed_violation(i, c_[i], jacobian_step_[i] + y_[i] / w_[i]);
    total += 0.5 * w_[i] * d * d;
  }
  return total;
}

}  // namespace tandem::detail
