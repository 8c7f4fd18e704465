#pragma once

#include <type_traits>

#include <tandem/problem/instruction_set.hpp>

/// Products of small column-major matrices whose number of rows is a compile-time constant. Each residual has its own
/// sizes, and Eigen expressions of them dominated the compile time of a problem. Compilers vectorise these plain loops
/// as well. The number of columns is an int or a std::integral_constant, see with_size(). All functions may be called
/// within dispatch_simd().
namespace tandem::detail {

/// Calls f(n), with n as a compile-time constant for the common dofs 6 and 3.
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

/// y += A x, with the number of rows at run time.
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

/// A ← A B with square B. `product` is scratch of the size of A.
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

/// A ← W A with square W.
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

/// H += A B, where `columns` is that of B and `stride` the distance between columns of H.
template <int rows, int inner, class N>
TANDEM_INLINED void add_product(N columns, const double* A, const double* B, double* H, int stride) {
  for (int j = 0; j < columns; ++j)
    add_multiplied<rows>(std::integral_constant<int, inner>(), A, B + j * inner, H + j * stride);
}
/// H += A B, with the number of rows at run time.
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
