#pragma once

#include <type_traits>

#include <tandem/problem/instruction_set.hpp>
#include <tandem/residuals/residual.hpp>

/// Products of small column-major matrices. Eigen expressions of them dominated the compile time of a problem.
/// Compilers vectorise these plain loops as well. Sizes are an int or, for the common ones, a std::integral_constant;
/// see with_size(). All functions may be called within dispatch_simd().
namespace tandem::detail {

/// Number of rows that an array for a column needs.
template <class N>
inline constexpr int kRoom = kMaxRows;
template <int n>
inline constexpr int kRoom<std::integral_constant<int, n>> = n;

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

/// y += A x, where A has few rows.
template <class M, class N>
TANDEM_INLINED void add_multiplied(M rows, N columns, const double* A, const double* x, double* y) {
  double sum[kRoom<M>];
  for (int i = 0; i < rows; ++i) sum[i] = y[i];
  for (int k = 0; k < columns; ++k)
    for (int i = 0; i < rows; ++i) sum[i] += A[k * rows + i] * x[k];
  for (int i = 0; i < rows; ++i) y[i] = sum[i];
}

/// y += A x, with the number of rows at run time.
TANDEM_INLINED void add_multiplied_directly(int rows, int columns, const double* A, const double* x, double* y) {
  for (int k = 0; k < columns; ++k)
    for (int i = 0; i < rows; ++i) y[i] += A[k * rows + i] * x[k];
}

/// y = Aᵀ x
template <class M, class N>
TANDEM_INLINED void multiply_transposed(M rows, N columns, const double* A, const double* x, double* y) {
  for (int j = 0; j < columns; ++j) {
    double sum = 0;
    for (int k = 0; k < rows; ++k) sum += A[j * rows + k] * x[k];
    y[j] = sum;
  }
}

/// A ← A B with square B. `product` is scratch of the size of A.
template <class M, class N>
TANDEM_INLINED void multiply_right(M rows, N columns, double* A, const double* B, double* product) {
  for (int j = 0; j < columns; ++j) {
    double sum[kRoom<M>];
    for (int i = 0; i < rows; ++i) sum[i] = 0;
    for (int k = 0; k < columns; ++k)
      for (int i = 0; i < rows; ++i) sum[i] += A[k * rows + i] * B[j * columns + k];
    for (int i = 0; i < rows; ++i) product[j * rows + i] = sum[i];
  }
  for (int i = 0; i < rows * columns; ++i) A[i] = product[i];
}

/// A ← W A with square W.
template <class M, class N>
TANDEM_INLINED void multiply_left(M rows, N columns, const double* W, double* A) {
  for (int j = 0; j < columns; ++j) {
    double sum[kRoom<M>];
    for (int i = 0; i < rows; ++i) sum[i] = 0;
    for (int k = 0; k < rows; ++k)
      for (int i = 0; i < rows; ++i) sum[i] += W[k * rows + i] * A[j * rows + k];
    for (int i = 0; i < rows; ++i) A[j * rows + i] = sum[i];
  }
}

/// A ← diag(d) A
template <class M, class N>
TANDEM_INLINED void scale_rows(M rows, N columns, const double* d, double* A) {
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < rows; ++i) A[j * rows + i] *= d[i];
}

/// T = factor Aᵀ
template <class M, class N>
TANDEM_INLINED void transpose(M rows, N columns, double factor, const double* A, double* T) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) T[i * columns + j] = factor * A[j * rows + i];
}

/// H += A B, where A has `inner` columns, B has `columns` columns, and the columns of H are `stride` entries apart. A
/// has few rows.
template <class M, class K, class N>
TANDEM_INLINED void add_product(M rows, K inner, N columns, const double* A, const double* B, double* H, int stride) {
  for (int j = 0; j < columns; ++j) add_multiplied(rows, inner, A, B + j * inner, H + j * stride);
}
/// H += A B, with the number of rows at run time.
template <class K>
TANDEM_INLINED void add_product_directly(int rows, K inner, int columns, const double* A, const double* B, double* H,
                                         int stride) {
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < rows; ++i) {
      double sum = 0;
      for (int k = 0; k < inner; ++k) sum += A[k * rows + i] * B[j * inner + k];
      H[j * stride + i] += sum;
    }
}

template <class N>
TANDEM_INLINED double squared_norm(N size, const double* x) {
  double sum = 0;
  for (int i = 0; i < size; ++i) sum += x[i] * x[i];
  return sum;
}

}  // namespace tandem::detail
