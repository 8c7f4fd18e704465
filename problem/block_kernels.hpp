#pragma once

/// The few products that pools need, over column-major arrays of compile-time size. Every residual has sizes of its own,
/// and as Eigen expressions these products took most of the time that a problem takes to compile; as plain loops over
/// columns compilers turn them into the same vector code.
namespace tandem::detail {

/// y = A x
template <int rows, int columns>
inline void multiply(const double* A, const double* x, double* y) {
  double sum[rows] = {};
  for (int k = 0; k < columns; ++k)
    for (int i = 0; i < rows; ++i) sum[i] += A[k * rows + i] * x[k];
  for (int i = 0; i < rows; ++i) y[i] = sum[i];
}

/// y += A x
template <int rows, int columns>
inline void add_multiplied(const double* A, const double* x, double* y) {
  double sum[rows];
  for (int i = 0; i < rows; ++i) sum[i] = y[i];
  for (int k = 0; k < columns; ++k)
    for (int i = 0; i < rows; ++i) sum[i] += A[k * rows + i] * x[k];
  for (int i = 0; i < rows; ++i) y[i] = sum[i];
}

/// y = Aᵀ x
template <int rows, int columns>
inline void multiply_transposed(const double* A, const double* x, double* y) {
  for (int j = 0; j < columns; ++j) {
    double sum = 0;
    for (int k = 0; k < rows; ++k) sum += A[j * rows + k] * x[k];
    y[j] = sum;
  }
}

/// A ← A B with B square.
template <int rows, int columns>
inline void multiply_right(double* A, const double* B) {
  double product[rows * columns];
  for (int j = 0; j < columns; ++j) multiply<rows, columns>(A, B + j * columns, product + j * rows);
  for (int i = 0; i < rows * columns; ++i) A[i] = product[i];
}

/// A ← W A with W square.
template <int rows, int columns>
inline void multiply_left(const double* W, double* A) {
  for (int j = 0; j < columns; ++j) multiply<rows, rows>(W, A + j * rows, A + j * rows);
}

/// A ← diag(d) A
template <int rows, int columns>
inline void scale_rows(const double* d, double* A) {
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < rows; ++i) A[j * rows + i] *= d[i];
}

/// T = factor Aᵀ
template <int rows, int columns>
inline void transpose(double factor, const double* A, double* T) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) T[i * columns + j] = factor * A[j * rows + i];
}

/// H += A B, the columns of H `stride` apart.
template <int rows, int inner, int columns>
inline void add_product(const double* A, const double* B, double* H, int stride) {
  for (int j = 0; j < columns; ++j) add_multiplied<rows, inner>(A, B + j * inner, H + j * stride);
}

/// H += (A B)ᵀ, the columns of H `stride` apart.
template <int rows, int inner, int columns>
inline void add_product_transposed(const double* A, const double* B, double* H, int stride) {
  for (int j = 0; j < columns; ++j) {
    double column[rows];
    multiply<rows, inner>(A, B + j * inner, column);
    for (int i = 0; i < rows; ++i) H[i * stride + j] += column[i];
  }
}

template <int size>
inline double squared_norm(const double* x) {
  double sum = 0;
  for (int i = 0; i < size; ++i) sum += x[i] * x[i];
  return sum;
}

}  // namespace tandem::detail
