#include <algorithm>
#include <cmath>

#include <tandem/solvers/linear/pivoted_kkt.hpp>

namespace tandem::detail {

void PivotedKkt::set_pattern(int n, int entries, const int* row, const int* column, int base) {
  n_ = n;
  row_.assign(row, row + entries);
  column_.assign(column, column + entries);
  for (auto* indices : {&row_, &column_})
    for (int& i : *indices) i -= base;
}

bool PivotedKkt::factorize(const double* values, const Eigen::VectorXd& added) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(2 * row_.size() + std::size_t(n_));
  for (std::size_t k = 0; k < row_.size(); ++k) {
    entries.emplace_back(row_[k], column_[k], values[k]);
    if (row_[k] != column_[k]) entries.emplace_back(column_[k], row_[k], values[k]);
  }
  for (int i = 0; i < n_; ++i) entries.emplace_back(i, i, added[i]);
  matrix_.resize(n_, n_);
  matrix_.setFromTriplets(entries.begin(), entries.end());
  scale_.setZero(n_);
  for (int j = 0; j < n_; ++j)
    for (Eigen::SparseMatrix<double>::InnerIterator it(matrix_, j); it; ++it)
      scale_[j] = std::max(scale_[j], std::abs(it.value()));
  for (double& s : scale_) s = s > 0 ? 1.0 / std::sqrt(s) : 1.0;
  matrix_ = scale_.asDiagonal() * matrix_ * scale_.asDiagonal();
  lu_.compute(matrix_);
  return lu_.info() == Eigen::Success;
}

void PivotedKkt::solve(Eigen::Ref<Eigen::VectorXd> rhs) {
  solution_ = scale_.cwiseProduct(rhs);
  solution_ = lu_.solve(solution_);
  rhs = scale_.cwiseProduct(solution_);
}

}  // namespace tandem::detail
