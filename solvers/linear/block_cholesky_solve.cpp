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

template <int N>
inline void BlockCholesky::backward_eights_by(int k, double* Y, int columns) const {
  const std::ptrdiff_t m = panel_rows_[std::size_t(k)];
  const int width = size_[std::size_t(k)];
  for (int first = width - N; first >= 0; first -= N) {  // N columns of the panel at a time
    const double* A = entries_ + panel_[std::size_t(k)] + first * m;
    double inverse[N];
    for (int c = 0; c < N; ++c) inverse[c] = 1 / A[first + c + c * m];
    for (int j = 0; j < columns; j += 8) {
      double* X = Y + j + std::ptrdiff_t(first_unknown_[std::size_t(k)] + first) * columns;
      detail::Eight x[N], later;
      for (int c = 0; c < N; ++c) detail::load(X + c * columns, x[c]);
      for (int b = below_start_[std::size_t(k)]; b < below_start_[std::size_t(k) + 1]; ++b) {
        const Below& below = below_[std::size_t(b)];
        const double* source = Y + j + std::ptrdiff_t(below.unknown) * columns;
        detail::subtract_transposed_eight<N>(below.rows, A + below.row, 1, m, source, columns, x);
      }
      for (int i = N; i < width - first; ++i) {
        detail::load(X + i * columns, later);
        for (int c = 0; c < N; ++c) x[c] -= A[first + i + c * m] * later;
      }
      for (int c = N - 1; c >= 0; --c) {
        for (int i = c + 1; i < N; ++i) x[c] -= A[first + i + c * m] * x[i];
        x[c] *= inverse[c];
        detail::store(x[c], X + c * columns);
      }
    }
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
  Columns X(n_, (columns + 7) / 8 * 8);
  std::fill_n(X.data(), X.size(), 0.0);  // several times as fast as Columns::Zero()
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
      if (size_[std::size_t(k)] == 6)
        backward_eights_by<6>(k, X.data(), int(X.cols()));
      else if (size_[std::size_t(k)] == 3)
        backward_eights_by<3>(k, X.data(), int(X.cols()));
      else
        backward_eights_by<1>(k, X.data(), int(X.cols()));
  });
  return X;
}

}  // namespace tandem
