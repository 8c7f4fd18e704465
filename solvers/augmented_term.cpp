#include <algorithm>
#include <cmath>

#include <tandem/solvers/augmented_term.hpp>

namespace tandem::detail {

AugmentedTerm::AugmentedTerm(Program& program) : program_(program) {
  const int rows = program.num_rows();
  for (Eigen::VectorXd* v : {&c_, &y_, &w_, &stiffness_, &along_, &segment_, &active_, &bound_, &trial_, &row_})
    v->setZero(rows);
  jacobian_.setZero(static_cast<Eigen::Index>(program.jacobian_pattern().row.size()));
  unknown_.setZero(rows > 0 ? program.num_unknowns() : 0);
}

void AugmentedTerm::linearize() {
  if (!empty()) program_.linearize_constraints(c_, jacobian_);
}

void AugmentedTerm::start(const Eigen::VectorXd& scale) {
  if (empty()) return;
  // An unknown that the cost does not curve is soft, but not infinitely so.
  const double stiffest = scale.maxCoeff(), softest = stiffest > 0 ? 1e-8 * stiffest : 1.0;
  const auto& pattern = program_.jacobian_pattern();
  stiffness_.setZero();
  for (std::size_t k = 0; k < pattern.row.size(); ++k) {
    const double J = jacobian_[Eigen::Index(k)];
    stiffness_[pattern.row[k]] += J * J / std::max(scale[pattern.column[k]], softest);
  }
  for (double& s : stiffness_) s = s > 0 ? 1.0 / s : 1.0;
  y_.setZero();
}

double AugmentedTerm::outside(Eigen::Index i, double z) const {
  return z - std::clamp(z, program_.lower()[i], program_.upper()[i]);
}

bool AugmentedTerm::is_active(Eigen::Index i, double z) const {
  return z < program_.lower()[i] || z > program_.upper()[i] || program_.lower()[i] == program_.upper()[i];
}

void AugmentedTerm::estimate_at(double step, Eigen::VectorXd& y) const {
  for (Eigen::Index i = 0; i < c_.size(); ++i) y[i] = w_[i] * outside(i, c_[i] + step * along_[i] + y_[i] / w_[i]);
}

double AugmentedTerm::value_of(const Eigen::VectorXd& c) const {
  double total = 0;
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    const double d = outside(i, c[i] + y_[i] / w_[i]);
    total += 0.5 * w_[i] * d * d;
  }
  return total;
}

double AugmentedTerm::value_at_point() {
  if (empty()) return 0.0;
  program_.constraints(trial_);
  return value_of(trial_);
}

double AugmentedTerm::mismatch(const Eigen::VectorXd& y) const {
  double largest = 0;
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const double projected = std::clamp(c_[i] + y[i] / stiffness_[i], program_.lower()[i], program_.upper()[i]);
    largest = std::max(largest, std::sqrt(stiffness_[i]) * std::abs(c_[i] - projected));
  }
  return largest;
}

double AugmentedTerm::relief(const Eigen::VectorXd& scale) {
  double size = 0;
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const double v = outside(i, c_[i]);
    row_[i] = stiffness_[i] * v;
    size += stiffness_[i] * v * v;
  }
  if (!(size > 0)) return 0.0;
  unknown_.setZero();
  add_transposed(row_, unknown_);
  const double softest = scale.maxCoeff() > 0 ? 1e-8 * scale.maxCoeff() : 1.0;
  double steepness = 0;
  for (Eigen::Index i = 0; i < scale.size(); ++i) steepness += unknown_[i] * unknown_[i] / std::max(scale[i], softest);
  return std::sqrt(steepness / size);
}

int AugmentedTerm::bad_row() const {
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    if (!std::isfinite(c_[i])) return static_cast<int>(i);
  for (Eigen::Index k = 0; k < jacobian_.size(); ++k)
    if (!std::isfinite(jacobian_[k])) return program_.jacobian_pattern().row[std::size_t(k)];
  return -1;
}

void AugmentedTerm::begin_step() {
  along_.setZero();
  activate();
}

void AugmentedTerm::activate() {
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const double z = c_[i] + along_[i] + y_[i] / w_[i];
    active_[i] = is_active(i, z) ? w_[i] : 0.0;
    bound_[i] = z - outside(i, z);
  }
}

void AugmentedTerm::add_gradient(Eigen::VectorXd& g) {
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    row_[i] = active_[i] > 0 ? active_[i] * (c_[i] - bound_[i]) + y_[i] : 0.0;
  add_transposed(row_, g);
}

void AugmentedTerm::aim(const Eigen::VectorXd& next, Eigen::VectorXd& g) {
  multiply(next, segment_);
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    row_[i] = active_[i] > 0 ? active_[i] * (c_[i] + segment_[i] - bound_[i]) + y_[i] : 0.0;
  add_transposed(row_, g);
  segment_ -= along_;
}

bool AugmentedTerm::settled() const {
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const double z = c_[i] + along_[i] + segment_[i] + y_[i] / w_[i];
    if (is_active(i, z) != (active_[i] > 0) || (active_[i] > 0 && z - outside(i, z) != bound_[i])) return false;
  }
  return true;
}

double AugmentedTerm::slope(double fraction) const {
  double total = 0;
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    total += w_[i] * outside(i, c_[i] + along_[i] + fraction * segment_[i] + y_[i] / w_[i]) * segment_[i];
  return total;
}

void AugmentedTerm::advance(double fraction) {
  along_ += fraction * segment_;
  activate();
}

double AugmentedTerm::model_value() const {
  double total = 0;
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const double d = outside(i, c_[i] + along_[i] + y_[i] / w_[i]);
    total += 0.5 * w_[i] * d * d;
  }
  return total;
}

}  // namespace tandem::detail
