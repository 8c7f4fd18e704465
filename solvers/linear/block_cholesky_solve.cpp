#include <algorithm>

#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/panel_kernels.hpp>

// Triangular solves of BlockCholesky, and the inverse blocks.
namespace tandem {

inline void BlockCholesky::forward_top(int k, double* y) const {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
  const double* P = entries_ + panel_[std::size_t(k)];
  double* x = y + first_unknown_[std::size_t(k)];
  for (int c = 0; c < n; ++c) {
    const double* column = P + std::ptrdiff_t(c) * m;
    x[c] /= column[c];
    for (int i = c + 1; i < n; ++i) x[i] -= column[i] * x[c];
  }
}

inline void BlockCholesky::forward_below(int begin, int end, int k, double* y) const {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
  const double* P = entries_ + panel_[std::size_t(k)];
  const double* x = y + first_unknown_[std::size_t(k)];
  for (int b = begin; b < end; ++b) {
    const Below& below = below_[std::size_t(b)];
    double* target = y + below.unknown;
    if (n == 6) {
      detail::subtract_columns<6>(below.rows, n, P + below.row, m, x, target);
    } else if (n == 3) {
      detail::subtract_columns<3>(below.rows, n, P + below.row, m, x, target);
    } else {
      detail::subtract_columns<0>(below.rows, n, P + below.row, m, x, target);
    }
  }
}

inline void BlockCholesky::forward_by(int k, double* y) const {
  forward_top(k, y);
  forward_below(below_start_[std::size_t(k)], below_start_[std::size_t(k) + 1], k, y);
}

inline void BlockCholesky::backward_by(int k, double* y) const {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
  const double* P = entries_ + panel_[std::size_t(k)];
  double* x = y + first_unknown_[std::size_t(k)];
  for (int b = below_start_[std::size_t(k)]; b < below_start_[std::size_t(k) + 1]; ++b) {
    const Below& below = below_[std::size_t(b)];
    const double* source = y + below.unknown;
    if (n == 6) {
      detail::subtract_dot_products<6>(below.rows, n, P + below.row, m, source, x);
    } else if (n == 3) {
      detail::subtract_dot_products<3>(below.rows, n, P + below.row, m, source, x);
    } else {
      detail::subtract_dot_products<0>(below.rows, n, P + below.row, m, source, x);
    }
  }
  for (int c = n - 1; c >= 0; --c) {
    const double* column = P + std::ptrdiff_t(c) * m;
    for (int i = c + 1; i < n; ++i) x[c] -= column[i] * x[i];
    x[c] /= column[c];
  }
}

inline void BlockCholesky::backward_eight_by(int k, double* Y, std::ptrdiff_t stride) const {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
  const double* P = entries_ + panel_[std::size_t(k)];
  double* X = Y + first_unknown_[std::size_t(k)] * stride;
  for (int c = n - 1; c >= 0; --c) {
    const double* column = P + std::ptrdiff_t(c) * m;
    double* x = X + c * stride;
    double sum[8];
    detail::copy(8, x, sum);
    for (int b = below_start_[std::size_t(k)]; b < below_start_[std::size_t(k) + 1]; ++b) {
      const Below& below = below_[std::size_t(b)];
      const double* source = Y + below.unknown * stride;
      for (int r = 0; r < below.rows; ++r) detail::subtract_eight(column[below.row + r], source + r * stride, sum);
    }
    for (int i = c + 1; i < n; ++i) detail::subtract_eight(column[i], X + i * stride, sum);
    const double inverse = 1 / column[c];
    for (int j = 0; j < 8; ++j) x[j] = inverse * sum[j];
  }
}

void BlockCholesky::forward(Eigen::VectorXd& y) const {
  for_both_halves([&](int p) {
    const Section& part = parts_[std::size_t(p)];
    detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
      for (int k = part.begin; k < part.end; ++k) {
        forward_top(k, y.data());
        forward_below(below_start_[std::size_t(k)], below_separator_[std::size_t(k)], k, y.data());
      }
    });
  });
  detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
    for (const int k : separator_columns_)
      forward_below(below_separator_[std::size_t(k)], below_start_[std::size_t(k) + 1], k, y.data());
    for (int k = parts_[2].begin; k < blocks_; ++k) forward_by(k, y.data());
  });
}

void BlockCholesky::backward(Eigen::VectorXd& y) const {
  const auto backward_through = [&](const Section& part) {
    detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
      for (int k = part.end - 1; k >= part.begin; --k) backward_by(k, y.data());
    });
  };
  backward_through(parts_[2]);
  for_both_halves([&](int p) { backward_through(parts_[std::size_t(p)]); });
}

void BlockCholesky::solve(Eigen::VectorXd& x) const {
  forward(x);
  backward(x);
}

/// Returns the blocks and all their ancestors in the elimination tree, in elimination order.
std::vector<int> BlockCholesky::ancestors_of(const std::vector<int>& blocks) const {
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
  for (const int block : blocks) n += dofs(block);
  const std::vector<int> ancestry = ancestors_of(blocks);
  Eigen::MatrixXd S(n, n);
  Eigen::VectorXd x(n_);
  int column = 0;
  for (const int block : blocks) {
    const int place = place_of_block_[std::size_t(block)];
    for (int i = 0; i < size_[std::size_t(place)]; ++i, ++column) {
      for (const int k : ancestry) x.segment(first_unknown_[std::size_t(k)], size_[std::size_t(k)]).setZero();
      x[first_unknown_[std::size_t(place)] + i] = 1;
      const auto first = std::lower_bound(ancestry.begin(), ancestry.end(), place) - ancestry.begin();
      detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
        for (std::size_t k = std::size_t(first); k < ancestry.size(); ++k) forward_by(ancestry[k], x.data());
        for (std::size_t k = ancestry.size(); k-- > 0;) backward_by(ancestry[k], x.data());
      });
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

BlockCholesky::Columns BlockCholesky::columns_of_inverse(const std::vector<int>& blocks) const {
  int columns = 0;
  for (const int block : blocks) columns += dofs(block);
  Columns X = Columns::Zero(n_, (columns + 7) / 8 * 8);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n_);
  int column = 0;
  for (const int block : blocks) {
    const std::vector<int> ancestry = ancestors_of({block});
    for (int i = 0; i < dofs(block); ++i, ++column) {
      x[first_unknown(block) + i] = 1;
      detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
        for (const int k : ancestry) forward_by(k, x.data());
      });
      for (const int k : ancestry) {
        const int first = first_unknown_[std::size_t(k)], n = size_[std::size_t(k)];
        X.col(column).segment(first, n) = x.segment(first, n);
        x.segment(first, n).setZero();
      }
    }
  }
  detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
    for (int k = blocks_ - 1; k >= 0; --k)
      for (int first = 0; first < columns; first += 8) backward_eight_by(k, X.data() + first, X.cols());
  });
  return X;
}

}  // namespace tandem
