#include <algorithm>
#include <cmath>

#include <tandem/solvers/linear/condensed_kkt.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

namespace tandem::detail {
namespace {

constexpr double kRegularization = 1e-8;    // For equalities, relative to the compliance of the cost along the row.
constexpr double kInequalityFactor = 1e-4;  // Factor for inequalities, whose slacks add to the regularisation.
// Regularisation of all rows in the pivoted factorisation, relative to the least term of the compliance. It only has to
// exceed rounding, for redundant rows.
constexpr double kPivotedRegularization = 1e-11;
constexpr double kNegligibleTerm = 1e-12;  // term of the compliance, relative to the sum

}  // namespace

int CondensedKkt::num_padding(const NlpEvaluator& nlp) {
  const auto equalities = (nlp.lower().array() == nlp.upper().array()).count();
  return std::max(0, static_cast<int>(equalities) + 1 - nlp.num_unknowns());
}

CondensedKkt::CondensedKkt(const NlpEvaluator& nlp)
    : nlp_(nlp),
      hessian_pattern_(nlp.hessian_pattern()),
      jacobian_pattern_(nlp.jacobian_pattern()),
      unknowns_(nlp.num_unknowns()),
      first_slack_(unknowns_ + num_padding(nlp)),
      factor_(nlp.hessian_pattern()) {
  factor_.use(nlp.tasks());
  const int rows = nlp.num_rows();
  const auto is_equality = [&](int row) { return nlp.lower()[row] == nlp.upper()[row]; };
  for (int row = 0; row < rows; ++row) ++(is_equality(row) ? equalities_ : inequalities_);
  int equality = 0, inequality = equalities_;
  for (int row = 0; row < rows; ++row) multiplier_.push_back(is_equality(row) ? equality++ : inequality++);
  for (std::size_t k = 0; k < jacobian_pattern_.row.size(); ++k)
    (is_equality(jacobian_pattern_.row[k]) ? equality_entries_ : inequality_entries_).push_back(static_cast<int>(k));

  hessian_.resize(hessian_pattern_.nonzeros());
  jacobian_.resize(static_cast<Eigen::Index>(jacobian_pattern_.row.size()));
  coupling_.resize(inequalities_);
  for (Vector* v : {&curvature_, &x_}) v->resize(unknowns_);
  for (Vector* v : {&compliance_, &regularized_, &weights_, &rows_}) v->resize(rows);
  diagonal_.resize(size());
}

bool CondensedKkt::analyze(int size, int entries, const int* row, const int* column, int base) {
  for (auto* entry : {&to_hessian_, &to_jacobian_, &to_diagonal_, &to_coupling_}) entry->clear();
  next_equality_ = next_inequality_ = 0;
  factorized_ = false;
  if (size != this->size()) return false;
  pivoted_.set_pattern(size, entries, row, column, base);
  const HessianEntries hessian{hessian_pattern_.column_starts(), hessian_pattern_.rows()};
  for (int k = 0; k < entries; ++k) {
    const auto [low, high] = std::minmax({row[k] - base, column[k] - base});
    if (!map_entry(k, high, low, hessian)) return false;
  }
  return next_equality_ == equality_entries_.size() && next_inequality_ == inequality_entries_.size();
}

void CondensedKkt::add(std::vector<Run>& runs, int from, int to) {
  if (!runs.empty() && runs.back().from + runs.back().size == from && runs.back().to + runs.back().size == to) {
    ++runs.back().size;
  } else {
    runs.push_back({from, to, 1});
  }
}

/// Maps an entry of the lower triangle to its place. Returns false if the matrix has another form.
bool CondensedKkt::map_entry(int entry, int row, int column, const HessianEntries& hessian) {
  const int slack = first_slack_, equality = slack + inequalities_, inequality = equality + equalities_;
  if (row < unknowns_) {
    const auto begin = hessian.row.begin() + hessian.column_start[std::size_t(column)],
               end = hessian.row.begin() + hessian.column_start[std::size_t(column) + 1];
    const auto at = std::lower_bound(begin, end, row);
    if (at == end || *at != row) return false;
    add(to_hessian_, entry, static_cast<int>(at - hessian.row.begin()));
    return true;
  }
  if (row == column) {
    add(to_diagonal_, entry, row);
    return true;
  }
  if (row >= equality && column < slack) {
    const auto& order = row < inequality ? equality_entries_ : inequality_entries_;
    std::size_t& next = row < inequality ? next_equality_ : next_inequality_;
    if (next == order.size()) return false;
    const std::size_t to = std::size_t(order[next++]);
    add(to_jacobian_, entry, static_cast<int>(to));
    return jacobian_pattern_.column[to] == column &&
           equality + multiplier_[std::size_t(jacobian_pattern_.row[to])] == row;
  }
  if (row - inequality != column - slack) return false;
  add(to_coupling_, entry, column - slack);
  return true;
}

void CondensedKkt::load(const double* values) {
  const auto fill = [&](const std::vector<Run>& runs, Vector& into) {
    into.setZero();
    for (const Run& run : runs) {
      const double* from = values + run.from;
      double* to = into.data() + run.to;
      for (int k = 0; k < run.size; ++k) to[k] += from[k];
    }
  };
  fill(to_hessian_, hessian_);
  fill(to_jacobian_, jacobian_);
  fill(to_diagonal_, diagonal_);
  fill(to_coupling_, coupling_);
}

/// Sets the compliance of the cost along each row: Jᵢ diag(H)⁻¹ Jᵢᵀ, or the least term of this sum.
void CondensedKkt::find_compliance(bool least) {
  hessian_diagonal(hessian_pattern_, hessian_, curvature_);
  curvature_ = curvature_.cwiseAbs();
  curvature_ = curvature_.cwiseMax(min_curvature(curvature_));
  const auto each_term = [&](auto f) {
    for (std::size_t k = 0; k < jacobian_pattern_.row.size(); ++k) {
      const double J = jacobian_[Eigen::Index(k)];
      f(multiplier_[std::size_t(jacobian_pattern_.row[k])], J * J / curvature_[jacobian_pattern_.column[k]]);
    }
  };
  compliance_.setZero();
  each_term([&](int i, double term) { compliance_[i] += term; });
  if (least) {
    rows_ = compliance_;
    each_term([&](int i, double term) {
      if (term > kNegligibleTerm * rows_[i]) compliance_[i] = std::min(compliance_[i], term);
    });
  }
  for (double& size : compliance_) size = size > 0 ? size : 1.0;
}

bool CondensedKkt::factorize(const double* values, bool pivoted) {
  factorized_ = pivoted ? factorize_condensed(values, true) || factorize_condensed(values, false)
                        : factorize_condensed(values, false);
  use_pivoted_ = pivoted;
  if (pivoted && factorized_) factorized_ = factorize_pivoted(values);
  return factorized_;
}

bool CondensedKkt::factorize_condensed(const double* values, bool least) {
  load(values);
  find_compliance(least);
  const auto given = -diagonal_.tail(num_constraints());
  for (int i = 0; i < num_constraints(); ++i)
    regularized_[i] =
        std::max(given[i], (i < equalities_ ? 1.0 : kInequalityFactor) * kRegularization * compliance_[i]);
  bool valid = (diagonal_.segment(unknowns_, first_slack_ - unknowns_).array() > 0).all();
  for (std::size_t row = 0; row < multiplier_.size(); ++row) {
    const int i = multiplier_[row], k = i - equalities_;
    double& weight = weights_[Eigen::Index(row)];
    if (k < 0) {
      weight = 1.0 / regularized_[i];
    } else {
      const double S = diagonal_[first_slack_ + k], B = coupling_[k];
      weight = S / (B * B + regularized_[i] * S);
    }
    valid = valid && weight >= 0 && std::isfinite(weight);
  }
  if (!valid) return false;
  nlp_.add_constraint_hessian(weights_, jacobian_, hessian_);
  return factor_.factorize(hessian_);
}

bool CondensedKkt::factorize_pivoted(const double* values) {
  load(values);  // M has replaced H
  find_compliance(true);
  Vector added = Vector::Zero(size());
  for (int i = 0, at = first_slack_ + inequalities_; i < num_constraints(); ++i, ++at)
    added[at] = -std::max(0.0, kPivotedRegularization * compliance_[i] + diagonal_[at]);
  return pivoted_.factorize(values, added);
}

void CondensedKkt::solve(double* rhs) {
  Eigen::Map<Vector> v(rhs, size());
  if (!factorized_) {
    v.setZero();
  } else if (use_pivoted_) {
    pivoted_.solve(v);
  } else {
    solve_condensed(v);
  }
}

/// The slack s and the multiplier y of an inequality follow from J x of its row,
///
///     s = (B (r_d − J x) + D r_s) / (B² + D S)        y = (B r_s − S (r_d − J x)) / (B² + D S)
///
/// and the multiplier of an equality is y = (J x − r_c) / C.
void CondensedKkt::solve_condensed(Eigen::Map<Vector>& v) {
  auto s = v.segment(first_slack_, inequalities_);
  auto y = v.tail(num_constraints());
  const auto S = diagonal_.segment(first_slack_, inequalities_);
  const auto pivot = [&](int k) { return coupling_[k] * coupling_[k] + regularized_[equalities_ + k] * S[k]; };

  for (int i = 0; i < equalities_; ++i) rows_[i] = y[i] / regularized_[i];
  for (int k = 0; k < inequalities_; ++k)
    rows_[equalities_ + k] = (S[k] * y[equalities_ + k] - coupling_[k] * s[k]) / pivot(k);
  x_ = v.head(unknowns_);
  for (std::size_t k = 0; k < jacobian_pattern_.row.size(); ++k)
    x_[jacobian_pattern_.column[k]] +=
        jacobian_[Eigen::Index(k)] * rows_[multiplier_[std::size_t(jacobian_pattern_.row[k])]];
  factor_.solve(x_);
  v.head(unknowns_) = x_;
  v.segment(unknowns_, first_slack_ - unknowns_).array() /=
      diagonal_.segment(unknowns_, first_slack_ - unknowns_).array();

  rows_ = y;  // r − J x
  for (std::size_t k = 0; k < jacobian_pattern_.row.size(); ++k)
    rows_[multiplier_[std::size_t(jacobian_pattern_.row[k])]] -=
        jacobian_[Eigen::Index(k)] * x_[jacobian_pattern_.column[k]];
  for (int i = 0; i < equalities_; ++i) y[i] = -rows_[i] / regularized_[i];
  for (int k = 0; k < inequalities_; ++k) {
    const int i = equalities_ + k;
    const double r_s = s[k];
    s[k] = (coupling_[k] * rows_[i] + regularized_[i] * r_s) / pivot(k);
    y[i] = (coupling_[k] * r_s - S[k] * rows_[i]) / pivot(k);
  }
}

}  // namespace tandem::detail
