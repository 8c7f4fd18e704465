#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>

#include <tandem/problem/instruction_set.hpp>

/// Dense kernels of a block Cholesky factorisation, column-major, for use within dispatch_simd(). Tiles of six rows (a
/// pose) or three rows stay in registers. Common widths are template parameters; with 0, the width is an argument.
namespace tandem::detail {

/// Calls f(rows, i) for tiles that cover m rows, with a constant number of rows each and i as the first one.
template <class F>
TANDEM_INLINED void in_tiles(int m, F f) {
  int i = 0;
  for (; i + 6 <= m; i += 6) f(std::integral_constant<int, 6>(), i);
  for (; i + 3 <= m; i += 3) f(std::integral_constant<int, 3>(), i);
  for (; i < m; ++i) f(std::integral_constant<int, 1>(), i);
}

/// Copies a few numbers; faster than a function call.
TANDEM_INLINED void copy(int m, const double* from, double* to) {
  in_tiles(m, [&](auto rows, int first) TANDEM_INLINED_HERE {
    for (int i = 0; i < rows; ++i) to[first + i] = from[first + i];
  });
}
TANDEM_INLINED void set_zero(int m, double* to) {
  in_tiles(m, [&](auto rows, int first) TANDEM_INLINED_HERE {
    for (int i = 0; i < rows; ++i) to[first + i] = 0.0;
  });
}

/// C −= A Bᵀ for `rows` rows of C and A; B has N rows, and both have K columns.
template <int rows, int N, int K>
TANDEM_INLINED void subtract_tile(int n_, int k_, double* __restrict C, std::ptrdiff_t ldc, const double* __restrict A,
                                  std::ptrdiff_t lda, const double* __restrict B, std::ptrdiff_t ldb) {
  const int n = N > 0 ? N : n_, k = K > 0 ? K : k_;
  for (int j = 0; j < n; ++j) {
    double sum[rows];
    for (int i = 0; i < rows; ++i) sum[i] = C[i + j * ldc];
    for (int p = 0; p < k; ++p)
      for (int i = 0; i < rows; ++i) sum[i] -= A[i + p * lda] * B[j + p * ldb];
    for (int i = 0; i < rows; ++i) C[i + j * ldc] = sum[i];
  }
}

/// C −= A Bᵀ for m rows.
template <int N, int K>
TANDEM_INLINED void subtract_product(int m, int n, int k, double* C, int ldc, const double* A, int lda, const double* B,
                                     int ldb) {
  in_tiles(m, [&](auto rows, int i)
                  TANDEM_INLINED_HERE { subtract_tile<rows(), N, K>(n, k, C + i, ldc, A + i, lda, B, ldb); });
}

TANDEM_INLINED void subtract_product_any(int m, int n, int k, double* C, int ldc, const double* A, int lda,
                                         const double* B, int ldb) {
  if (n == 6 && k == 6) return subtract_product<6, 6>(m, n, k, C, ldc, A, lda, B, ldb);
  if (n == 3 && k == 3) return subtract_product<3, 3>(m, n, k, C, ldc, A, lda, B, ldb);
  subtract_product<0, 0>(m, n, k, C, ldc, A, lda, B, ldb);
}

/// X ← X L⁻ᵀ for `rows` rows, with L the top of the panel and `inverse` the inverse of its diagonal.
template <int rows, int N>
TANDEM_INLINED void solve_tile(int n_, const double* __restrict L, double* __restrict X, std::ptrdiff_t ld,
                               const double* inverse) {
  const int n = N > 0 ? N : n_;
  for (int c = 0; c < n; ++c) {
    double sum[rows];
    for (int i = 0; i < rows; ++i) sum[i] = X[i + c * ld];
    for (int p = 0; p < c; ++p)
      for (int i = 0; i < rows; ++i) sum[i] -= X[i + p * ld] * L[c + p * ld];
    for (int i = 0; i < rows; ++i) X[i + c * ld] = sum[i] * inverse[c];
  }
}

/// Factorises the top of a panel, N × N, and solves for the rows below it, down to row m. Columns for whose pivot
/// weak(c, pivot) is true are cleared. Returns false at the first other column, `failed`, whose pivot is not positive.
template <int N, class Weak>
TANDEM_INLINED bool factor_panel(int n_, int m, double* P, double* inverse, int& failed, Weak weak) {
  const int n = N > 0 ? N : n_;
  const std::ptrdiff_t ld = m;
  for (int c = 0; c < n; ++c) {
    double* column = P + c * ld;
    for (int p = 0; p < c; ++p)
      for (int i = c; i < n; ++i) column[i] -= P[c + p * ld] * P[i + p * ld];
    const double pivot = column[c];
    if (weak(c, pivot)) {
      for (int i = c + 1; i < n; ++i) column[i] = 0.0;
      column[c] = 1.0;
      inverse[c] = 0.0;
      continue;
    }
    if (!(pivot > 0) || !std::isfinite(pivot)) {
      failed = c;
      return false;
    }
    column[c] = std::sqrt(pivot);
    inverse[c] = 1.0 / column[c];
    for (int i = c + 1; i < n; ++i) column[i] *= inverse[c];
  }
  in_tiles(m - n, [&](auto rows, int i) TANDEM_INLINED_HERE { solve_tile<rows(), N>(n, P, P + n + i, ld, inverse); });
  return true;
}

/// y −= A x for m rows and N columns.
template <int N>
TANDEM_INLINED void subtract_columns(int m, int n_, const double* A, std::ptrdiff_t lda, const double* x, double* y) {
  const int n = N > 0 ? N : n_;
  in_tiles(m, [&](auto rows, int first) TANDEM_INLINED_HERE {
    double sum[rows()];
    for (int i = 0; i < rows; ++i) sum[i] = y[first + i];
    for (int c = 0; c < n; ++c)
      for (int i = 0; i < rows; ++i) sum[i] -= A[first + i + c * lda] * x[c];
    for (int i = 0; i < rows; ++i) y[first + i] = sum[i];
  });
}

/// y −= Aᵀ x for m rows and N columns. The products of a tile with a column are summed in registers.
template <int N>
TANDEM_INLINED void subtract_dot_products(int m, int n_, const double* A, std::ptrdiff_t lda, const double* x,
                                          double* y) {
  const int n = N > 0 ? N : n_;
  in_tiles(m, [&](auto rows, int first) TANDEM_INLINED_HERE {
    double at[rows()];
    for (int i = 0; i < rows; ++i) at[i] = x[first + i];
    for (int c = 0; c < n; ++c) {
      double sum = 0;
      for (int i = 0; i < rows; ++i) sum += A[first + i + c * lda] * at[i];
      y[c] -= sum;
    }
  });
}

/// y −= a x for eight columns.
TANDEM_INLINED void subtract_eight(double a, const double* __restrict x, double* __restrict y) {
  for (int i = 0; i < 8; ++i) y[i] -= a * x[i];
}

/// Eight columns of a row in registers. Compilers vectorise loops over arrays of rows worse.
using Eight [[gnu::vector_size(64)]] = double;
TANDEM_INLINED void load(const double* from, Eight& to) { std::memcpy(&to, from, sizeof(to)); }
TANDEM_INLINED void store(const Eight& from, double* to) { std::memcpy(to, &from, sizeof(from)); }

/// S −= Aᵀ Y for eight columns of Y, with m rows at a distance of ldy, and N columns of A.
template <int N>
TANDEM_INLINED void subtract_transposed_eight(int m, const double* A, std::ptrdiff_t row_stride,
                                              std::ptrdiff_t column_stride, const double* Y, std::ptrdiff_t ldy,
                                              Eight (&S)[N]) {
  Eight y;
  for (int r = 0; r < m; ++r) {
    load(Y + r * ldy, y);
    for (int c = 0; c < N; ++c) S[c] -= A[r * row_stride + c * column_stride] * y;
  }
}

}  // namespace tandem::detail
