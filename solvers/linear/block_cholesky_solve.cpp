#include <algorithm>

#include <tandem/solvers/linear/block_cholesky.hpp>

// Triangular solves, and what is made of them.
namespace tandem {
namespace {

/// y −= A x for A of m × n, its columns `stride` apart; n at compile time where it is above zero.
template <int N>
void subtract_columns(int m, int n_, const double* __restrict A, int stride, const double* __restrict x,
                      double* __restrict y) {
  const int n = N > 0 ? N : n_;
  for (int i = 0; i < m; ++i) {
    double left = y[i];
    for (int c = 0; c < n; ++c) left -= A[i + std::ptrdiff_t(c) * stride] * x[c];
    y[i] = left;
  }
}

/// y −= Aᵀ x, A and n as above: a sum of its own for each column, so that none waits for another.
template <int N>
void subtract_dot_products(int m, int n_, const double* __restrict A, int stride, const double* __restrict x,
                           double* __restrict y) {
  const int n = N > 0 ? N : n_;
  for (int i = 0; i < m; ++i)
    for (int c = 0; c < n; ++c) y[c] -= A[i + std::ptrdiff_t(c) * stride] * x[i];
}

}  // namespace

void BlockCholesky::forward_by(int k, double* y) const {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
  const double* P = values_.data() + panel_[std::size_t(k)];
  double* x = y + first_unknown_[std::size_t(k)];
  for (int c = 0; c < n; ++c) {
    const double* column = P + std::ptrdiff_t(c) * m;
    x[c] /= column[c];
    for (int i = c + 1; i < n; ++i) x[i] -= column[i] * x[c];
  }
  for (int b = below_start_[std::size_t(k)]; b < below_start_[std::size_t(k) + 1]; ++b) {
    const Below& below = below_[std::size_t(b)];
    double* target = y + below.unknown;
    if (n == 6) {
      subtract_columns<6>(below.rows, n, P + below.row, m, x, target);
    } else if (n == 3) {
      subtract_columns<3>(below.rows, n, P + below.row, m, x, target);
    } else {
      subtract_columns<0>(below.rows, n, P + below.row, m, x, target);
    }
  }
}

void BlockCholesky::backward_by(int k, double* y) const {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
  const double* P = values_.data() + panel_[std::size_t(k)];
  double* x = y + first_unknown_[std::size_t(k)];
  for (int b = below_start_[std::size_t(k)]; b < below_start_[std::size_t(k) + 1]; ++b) {
    const Below& below = below_[std::size_t(b)];
    const double* source = y + below.unknown;
    if (n == 6) {
      subtract_dot_products<6>(below.rows, n, P + below.row, m, source, x);
    } else if (n == 3) {
      subtract_dot_products<3>(below.rows, n, P + below.row, m, source, x);
    } else {
      subtract_dot_products<0>(below.rows, n, P + below.row, m, source, x);
    }
  }
  for (int c = n - 1; c >= 0; --c) {
    const double* column = P + std::ptrdiff_t(c) * m;
    for (int i = c + 1; i < n; ++i) x[c] -= column[i] * x[i];
    x[c] /= column[c];
  }
}

void BlockCholesky::forward(Eigen::VectorXd& y) const {
  for (int k = 0; k < blocks_; ++k) forward_by(k, y.data());
}

void BlockCholesky::backward(Eigen::VectorXd& y) const {
  for (int k = blocks_ - 1; k >= 0; --k) backward_by(k, y.data());
}

void BlockCholesky::solve(Eigen::VectorXd& x) const {
  forward(x);
  backward(x);
}

/// Each block, its parent in the elimination tree, the parent's, and so on to the root; in the order of elimination.
std::vector<int> BlockCholesky::ancestry_of(const std::vector<int>& blocks) const {
  std::vector<int> ancestry;
  std::vector<char> seen(std::size_t(blocks_), 0);
  for (const int block : blocks)
    for (int k = place_of_block_[std::size_t(block)]; k >= 0 && !seen[std::size_t(k)];) {
      seen[std::size_t(k)] = 1;
      ancestry.push_back(k);
      const std::size_t parent = std::size_t(row_start_[std::size_t(k)]) + 1;
      k = parent < std::size_t(row_start_[std::size_t(k) + 1]) ? row_block_[parent] : -1;
    }
  std::sort(ancestry.begin(), ancestry.end());
  return ancestry;
}

Eigen::MatrixXd BlockCholesky::inverse_of(const std::vector<int>& blocks) const {
  int n = 0;
  for (const int block : blocks) n += size_[std::size_t(place_of_block_[std::size_t(block)])];
  const std::vector<int> ancestry = ancestry_of(blocks);
  Eigen::MatrixXd S(n, n);
  Eigen::VectorXd x(n_);
  int column = 0;
  for (const int block : blocks) {
    const int place = place_of_block_[std::size_t(block)];
    for (int i = 0; i < size_[std::size_t(place)]; ++i, ++column) {
      for (const int k : ancestry) x.segment(first_unknown_[std::size_t(k)], size_[std::size_t(k)]).setZero();
      x[first_unknown_[std::size_t(place)] + i] = 1;
      for (auto k = std::lower_bound(ancestry.begin(), ancestry.end(), place); k != ancestry.end(); ++k)
        forward_by(*k, x.data());
      for (auto k = ancestry.rbegin(); k != ancestry.rend(); ++k) backward_by(*k, x.data());
      int row = 0;
      for (const int other : blocks) {
        const std::size_t at = std::size_t(place_of_block_[std::size_t(other)]);
        S.col(column).segment(row, size_[at]) = x.segment(first_unknown_[at], size_[at]);
        row += size_[at];
      }
    }
  }
  return S;
}

}  // namespace tandem
