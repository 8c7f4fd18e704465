#include <algorithm>

#include <tandem/solvers/fixed_lag/constrained_inverse.hpp>

namespace tandem::detail {
namespace {

constexpr double kDetermined = 1e-3;  // largest remaining share of the variance of an unknown that the rows determine

}  // namespace

void ConstrainedInverse::add(const BlockCholesky& factor, const ActiveRows& rows, const std::vector<int>& blocks) {
  const Eigen::Index before = inverse_.cols();
  for (const int block : blocks) {
    first_column_[block] = int(unknowns_.size());
    for (int i = 0; i < factor.dofs(block); ++i) unknowns_.push_back(factor.first_unknown(block) + i);
  }
  const Eigen::Index columns = Eigen::Index(unknowns_.size());
  const BlockCholesky::Columns X = factor.columns_of_inverse(blocks), white = rows.white_product(X);
  inverse_.conservativeResize(X.rows(), columns);
  white_.conservativeResize(white.rows(), columns);
  selected_.conservativeResize(columns, columns);
  inverse_.rightCols(columns - before) = X.leftCols(columns - before);
  white_.rightCols(columns - before) = white.leftCols(columns - before);
  // Each entry is computed once, in a way that does not depend on the order of the requests.
  for (Eigen::Index j = before; j < columns; ++j)
    for (Eigen::Index i = 0; i <= j; ++i) {
      const auto [row, column] = std::minmax(
          i, j, [&](Eigen::Index a, Eigen::Index b) { return unknowns_[std::size_t(a)] < unknowns_[std::size_t(b)]; });
      selected_(i, j) = selected_(j, i) =
          inverse_(unknowns_[std::size_t(row)], column) - white_.col(i).dot(white_.col(j));
    }
  // The variance of an unknown that the rows determine is zero; the step leaves a small share of it.
  for (Eigen::Index i = 0; i < columns; ++i)
    if (selected_(i, i) <= kDetermined * inverse_(unknowns_[std::size_t(i)], i)) {
      selected_.row(i).setZero();
      selected_.col(i).setZero();
    }
}

Eigen::MatrixXd ConstrainedInverse::of(const BlockCholesky& factor, const ActiveRows& rows,
                                       const std::vector<int>& blocks) {
  std::vector<int> missing, columns;
  for (const int block : blocks)
    if (!first_column_.contains(block)) missing.push_back(block);
  if (!missing.empty()) add(factor, rows, missing);
  for (const int block : blocks)
    for (int i = 0; i < factor.dofs(block); ++i) columns.push_back(first_column_[block] + i);
  return selected_(columns, columns);
}

}  // namespace tandem::detail
