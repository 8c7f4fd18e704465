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

/// Both in the pattern's order of unknowns, in place: each block's are consecutive there too.
void BlockCholesky::forward(Eigen::VectorXd& y, int from) const {
  for (int k = from; k < blocks_; ++k) {
    const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
    const double* P = values_.data() + panel_[std::size_t(k)];
    double* x = y.data() + first_unknown_[std::size_t(k)];
    for (int c = 0; c < n; ++c) {
      const double* column = P + std::ptrdiff_t(c) * m;
      x[c] /= column[c];
      for (int i = c + 1; i < n; ++i) x[i] -= column[i] * x[c];
    }
    for (int b = below_start_[std::size_t(k)]; b < below_start_[std::size_t(k) + 1]; ++b) {
      const Below& below = below_[std::size_t(b)];
      double* target = y.data() + below.unknown;
      if (n == 6) {
        subtract_columns<6>(below.rows, n, P + below.row, m, x, target);
      } else if (n == 3) {
        subtract_columns<3>(below.rows, n, P + below.row, m, x, target);
      } else {
        subtract_columns<0>(below.rows, n, P + below.row, m, x, target);
      }
    }
  }
}

void BlockCholesky::backward(Eigen::VectorXd& y, int to) const {
  for (int k = blocks_ - 1; k >= to; --k) {
    const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
    const double* P = values_.data() + panel_[std::size_t(k)];
    double* x = y.data() + first_unknown_[std::size_t(k)];
    for (int b = below_start_[std::size_t(k)]; b < below_start_[std::size_t(k) + 1]; ++b) {
      const Below& below = below_[std::size_t(b)];
      const double* source = y.data() + below.unknown;
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
}

void BlockCholesky::solve(Eigen::VectorXd& x) const {
  forward(x);
  backward(x);
}

Eigen::MatrixXd BlockCholesky::inverse_of(const std::vector<int>& blocks) const {
  int first = blocks_, n = 0;
  for (const int block : blocks) {
    const int place = place_of_block_[std::size_t(block)];
    first = std::min(first, place);
    n += size_[std::size_t(place)];
  }
  Eigen::MatrixXd S(n, n);
  Eigen::VectorXd x(n_);
  int column = 0;
  for (const int block : blocks) {
    const int place = place_of_block_[std::size_t(block)];
    for (int i = 0; i < size_[std::size_t(place)]; ++i, ++column) {
      x.setZero();
      x[first_unknown_[std::size_t(place)] + i] = 1;
      forward(x, place);
      backward(x, first);
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
