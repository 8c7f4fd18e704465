#pragma once

#include <type_traits>

#include <tandem/problem/instruction_set.hpp>

/// The few products that pools need, over column-major arrays whose number of rows is known when they are compiled. Every
/// residual has sizes of its own, and as Eigen expressions these products took most of the time that a problem takes to
/// compile; as plain loops over columns compilers turn them into the same vector code. The number of columns is an int, or a
/// constant of type std::integral_constant: see with_size(). All are for at_best(), too.
namespace tandem::detail {

/// f(n), with n a constant where it is a usual size of a state.
template <class F>
TANDEM_INLINED void with_size(int n, F f) {
  if (n == 6)
    f(std::integral_constant<int, 6>());
  else if (n == 3)
    f(std::integral_constant<int, 3>());
  else
    f(n);
}

/// y += A x
template <int rows, class N>
TANDEM_INLINED void add_multiplied(N columns, const double* A, const double* x, double* y) {
  double sum[rows];
  for (int i = 0; i < rows; ++i) sum[i] = y[i];
  for (int k = 0; k < columns; ++k)
    for (int i = 0; i < rows; ++i) sum[i] += A[k * rows + i] * x[k];
  for (int i = 0; i < rows; ++i) y[i] = sum[i];
}

/// The same of any number of rows.
TANDEM_INLINED void add_multiplied(int rows, int columns, const double* A, const double* x, double* y) {
  for (int k = 0; k < columns; ++k)
    for (int i = 0; i < rows; ++i) y[i] += A[k * rows + i] * x[k];
}

/// y = Aᵀ x
template <int rows, class N>
TANDEM_INLINED void multiply_transposed(N columns, const double* A, const double* x, double* y) {
  for (int j = 0; j < columns; ++j) {
    double sum = 0;
    for (int k = 0; k < rows; ++k) sum += A[j * rows + k] * x[k];
    y[j] = sum;
  }
}

/// A ← A B with B square; `product` has room for A.
template <int rows, class N>
TANDEM_INLINED void multiply_right(N columns, double* A, const double* B, double* product) {
  for (int j = 0; j < columns; ++j) {
    double sum[rows] = {};
    for (int k = 0; k < columns; ++k)
      for (int i = 0; i < rows; ++i) sum[i] += A[k * rows + i] * B[j * columns + k];
    for (int i = 0; i < rows; ++i) product[j * rows + i] = sum[i];
  }
  for (int i = 0; i < rows * columns; ++i) A[i] = product[i];
}

/// A ← W A with W square.
template <int rows, class N>
TANDEM_INLINED void multiply_left(N columns, const double* W, double* A) {
  for (int j = 0; j < columns; ++j) {
    double sum[rows] = {};
    for (int k = 0; k < rows; ++k)
      for (int i = 0; i < rows; ++i) sum[i] += W[k * rows + i] * A[j * rows + k];
    for (int i = 0; i < rows; ++i) A[j * rows + i] = sum[i];
  }
}

/// A ← diag(d) A
template <int rows, class N>
TANDEM_INLINED void scale_rows(N columns, const double* d, double* A) {
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < rows; ++i) A[j * rows + i] *= d[i];
}

/// T = factor Aᵀ
template <int rows, class N>
TANDEM_INLINED void transpose(N columns, double factor, const double* A, double* T) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) T[i * columns + j] = factor * A[j * rows + i];
}

/// H += A B, the columns of H `stride` apart; B of so many columns.
template <int rows, int inner, class N>
TANDEM_INLINED void add_product(N columns, const double* A, const double* B, double* H, int stride) {
  for (int j = 0; j < columns; ++j)
    add_multiplied<rows>(std::integral_constant<int, inner>(), A, B + j * inner, H + j * stride);
}
/// The same of any number of rows.
template <int inner>
TANDEM_INLINED void add_product(int rows, int columns, const double* A, const double* B, double* H, int stride) {
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < rows; ++i) {
      double sum = 0;
      for (int k = 0; k < inner; ++k) sum += A[k * rows + i] * B[j * inner + k];
      H[j * stride + i] += sum;
    }
}

template <int size>
TANDEM_INLINED double squared_norm(const double* x) {
  double sum = 0;
  for (int i = 0; i < size; ++i) sum += x[i] * x[i];
  return sum;
}

}  // namespace tandem::detail
