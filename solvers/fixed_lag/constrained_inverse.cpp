#include <algorithm>

#include <tandem/solvers/fixed_lag/constrained_inverse.hpp>
#include <tandem/solvers/linear/panel_kernels.hpp>

namespace tandem::detail {
namespace {

constexpr double kDetermined = 1e-3;  // largest remaining share of the variance of an unknown that the rows determine

/// Returns −AᵀB for matrices of a multiple of eight columns.
BlockCholesky::Columns negative_products(const BlockCholesky::Columns& A, const BlockCholesky::Columns& B) {
  BlockCholesky::Columns products(A.cols(), B.cols());
  dispatch_simd([&]() TANDEM_INLINED_HERE {
    constexpr int kTile = 4;
    for (Eigen::Index i = 0; i < A.cols(); i += kTile)
      for (Eigen::Index j = 0; j < B.cols(); j += 8) {
        Eight sum[kTile] = {};
        subtract_transposed_eight<kTile>(int(A.rows()), A.data() + i, A.cols(), 1, B.data() + j, B.cols(), sum);
        for (int c = 0; c < kTile; ++c) store(sum[c], products.data() + (i + c) * B.cols() + j);
      }
  });
  return products;
}

}  // namespace

void ConstrainedInverse::add(const BlockCholesky& factor, const ActiveRows& rows, const std::vector<int>& blocks) {
  const std::size_t before = columns_.size(), request = requests_.size();
  for (const int block : blocks) {
    first_column_[block] = int(columns_.size());
    for (int i = 0; i < factor.dofs(block); ++i)
      columns_.push_back({factor.first_unknown(block) + i, request, Eigen::Index(columns_.size() - before)});
  }
  requests_.push_back({factor.columns_of_inverse(blocks), {}});
  requests_.back().white = rows.white_product(requests_.back().inverse);
  const auto inverse = [&](const Column& a, const Column& b) {
    const Column& right = a.unknown < b.unknown ? b : a;
    return requests_[right.request].inverse(std::min(a.unknown, b.unknown), right.at);
  };
  selected_.conservativeResize(Eigen::Index(columns_.size()), Eigen::Index(columns_.size()));
  // Each entry is computed once, in a way that does not depend on the order of the requests.
  for (std::size_t j = 0, of = 0; of <= request; ++of) {
    const BlockCholesky::Columns products = negative_products(requests_[of].white, requests_.back().white);
    for (; j < columns_.size() && columns_[j].request == of; ++j)
      for (std::size_t i = before; i < columns_.size(); ++i) {
        const auto row = Eigen::Index(i), column = Eigen::Index(j);
        selected_(row, column) = selected_(column, row) =
            inverse(columns_[i], columns_[j]) + products(columns_[j].at, columns_[i].at);
      }
  }
  // The variance of an unknown that the rows determine is zero; the step leaves a small share of it.
  for (std::size_t i = 0; i < columns_.size(); ++i)
    if (selected_(Eigen::Index(i), Eigen::Index(i)) <= kDetermined * inverse(columns_[i], columns_[i])) {
      selected_.row(Eigen::Index(i)).setZero();
      selected_.col(Eigen::Index(i)).setZero();
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
