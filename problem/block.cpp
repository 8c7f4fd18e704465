#include <algorithm>
#include <array>

#include <tandem/problem/block.hpp>

namespace tandem::detail {
namespace {

/// Adds one column of the block's Hessian, for entry k of state B, from the gradients at both sides of the point.
void add_hessian_column(const BlockShape& shape, const HessianPlace* place, int B, int k, const double* plus,
                        const double* minus, double* H) {
  const int* offset = shape.offset;
  for (int A = 0; A < shape.arity; ++A) {
    if (offset[A] < 0) continue;
    const int a = std::max(A, B), b = std::min(A, B), first = shape.first(A);
    const HessianPlace& at = place[a * (a + 1) / 2 + b];
    const int stride = int(at.stride);
    for (int m = 0; m < shape.dofs[A]; ++m) {
      const double column = (plus[first + m] - minus[first + m]) / (2 * kGradientStep);
      // Each ordered pair of entries occurs twice. Adding half of each keeps the Hessian symmetric.
      if (A == B) {
        H[at.position + k * stride + m] += 0.5 * column;
        H[at.position + m * stride + k] += 0.5 * column;
      } else {
        const bool same = offset[A] == offset[B], rows_of_A = same || (A == a) != bool(at.transposed);
        H[at.position + (rows_of_A ? k * stride + m : m * stride + k)] += same ? column : 0.5 * column;
      }
    }
  }
}

/// Computes block = chartAᵀ C chartB; a null chart is the identity. C has `n` rows. A and B are compile-time sizes, or
/// 0 to use a_ and b_.
template <int A, int B>
TANDEM_INLINED void congruence(int a_, int b_, const double* C, int n, const double* of_A, const double* of_B,
                               double* block) {
  const int a = A ? A : a_, b = B ? B : b_;
  constexpr int max_a = A ? A : kMaxDofs, max_b = B ? B : kMaxDofs;
  double right[max_a * max_b];  // C chartB
  for (int m = 0; m < b; ++m) {
    double* column = right + m * a;
    if (!of_B) {
      std::copy_n(C + m * n, a, column);
      continue;
    }
    std::fill_n(column, a, 0.0);
    for (int j = 0; j < b; ++j)
      for (int k = 0; k < a; ++k) column[k] += C[j * n + k] * of_B[m * b + j];
  }
  if (!of_A) {
    std::copy_n(right, a * b, block);
    return;
  }
  double left[max_a * max_a];  // chartAᵀ
  for (int k = 0; k < a; ++k)
    for (int j = 0; j < a; ++j) left[j * a + k] = of_A[k * a + j];
  for (int m = 0; m < b; ++m) {
    double* column = block + m * a;
    std::fill_n(column, a, 0.0);
    for (int j = 0; j < a; ++j)
      for (int k = 0; k < a; ++k) column[k] += left[j * a + k] * right[m * a + j];
  }
}

TANDEM_INLINED void add_block_curvature_inlined(const BlockShape& shape, const HessianPlace* place,
                                                const double* const* J, const double* const* charts, const double* w,
                                                const double* C, double* gradient, double* H) {
  const int* offset = shape.offset;
  const int n = shape.first(shape.arity);
  for (int A = 0, first_a = 0; A < shape.arity; first_a += shape.dofs[A], ++A) {
    if (offset[A] < 0) continue;
    const int a = shape.dofs[A];
    for (int k = 0; k < a; ++k)
      for (int row = 0; row < shape.dim; ++row) gradient[offset[A] + k] += J[A][k * shape.dim + row] * w[row];
    for (int B = 0, first_b = 0; B <= A; first_b += shape.dofs[B], ++B) {
      if (offset[B] < 0) continue;
      const int b = shape.dofs[B];
      double block[kMaxDofs * kMaxDofs];
      const double* at_C = C + first_b * n + first_a;
      if (a == 6 && b == 6)  // SE(3)
        congruence<6, 6>(a, b, at_C, n, charts[A], charts[B], block);
      else
        congruence<0, 0>(a, b, at_C, n, charts[A], charts[B], block);
      const HessianPlace& at = place[A * (A + 1) / 2 + B];
      double* to = H + at.position;
      const int stride = int(at.stride);
      if (!at.transposed)
        for (int m = 0; m < b; ++m)
          for (int k = 0; k < a; ++k) to[m * stride + k] += block[m * a + k];
      if (A != B && (at.transposed || offset[A] == offset[B]))
        for (int m = 0; m < b; ++m)
          for (int k = 0; k < a; ++k) to[k * stride + m] += block[m * a + k];
    }
  }
}

}  // namespace

void soft_block_dual(int dim, const BlockWeight& weight, double factor, const double* r, double* w) {
  std::array<double, kMaxRows> whitened;
  std::copy_n(r, dim, whitened.begin());
  whiten(dim, 1, weight.diagonal, weight.full, whitened.data());
  double squares = 0;
  for (int i = 0; i < dim; ++i) squares += whitened[std::size_t(i)] * whitened[std::size_t(i)];
  const double d1 = factor * weight.loss(squares).d1;
  for (int i = 0; i < dim; ++i) {
    if (weight.full) {
      w[i] = 0;
      for (int k = 0; k < dim; ++k) w[i] += d1 * weight.full[i * dim + k] * whitened[std::size_t(k)];
    } else {
      w[i] = d1 * weight.diagonal[i] * whitened[std::size_t(i)];
    }
  }
}

void block_gradient(const BlockShape& shape, const double* const* J, const double* const* charts, const double* w,
                    double* gradient) {
  for (int s = 0; s < shape.arity; gradient += shape.dofs[s], ++s) {
    if (shape.offset[s] < 0) continue;
    const int dof = shape.dofs[s];
    for (int j = 0; j < dof; ++j) {
      double sum = 0;
      for (int k = 0; k < shape.dim; ++k) sum += J[s][j * shape.dim + k] * w[k];
      gradient[j] = sum;
    }
    if (!charts[s]) continue;
    double product[kMaxDofs];  // chartᵀ (Jᵀ w)
    for (int j = 0; j < dof; ++j) {
      product[j] = 0;
      for (int k = 0; k < dof; ++k) product[j] += charts[s][j * dof + k] * gradient[k];
    }
    std::copy_n(product, dof, gradient);
  }
}

void add_difference_hessian(const BlockShape& shape, const HessianPlace* place,
                            FunctionRef<void(int, int, double, double*)> near, double* H) {
  std::array<double, std::size_t(kMaxStates * kMaxDofs)> plus, minus;
  for (int B = 0; B < shape.arity; ++B) {
    if (shape.offset[B] < 0) continue;
    for (int k = 0; k < shape.dofs[B]; ++k) {
      near(B, k, kGradientStep, plus.data());
      near(B, k, -kGradientStep, minus.data());
      add_hessian_column(shape, place, B, k, plus.data(), minus.data(), H);
    }
  }
}

void add_block_curvature(const BlockShape& shape, const HessianPlace* place, const double* const* J,
                         const double* const* charts, const double* w, const double* C, double* gradient, double* H) {
  dispatch_simd([&]() TANDEM_INLINED_HERE { add_block_curvature_inlined(shape, place, J, charts, w, C, gradient, H); });
}

void whiten(int rows, int columns, const double* diagonal, const double* full, double* A) {
  for (int j = 0; j < columns; ++j, A += rows) {
    if (!full) {
      for (int i = 0; i < rows; ++i) A[i] *= diagonal[i];
      continue;
    }
    std::array<double, kMaxRows> column{};
    for (int k = 0; k < rows; ++k)
      for (int i = 0; i < rows; ++i) column[std::size_t(i)] += full[k * rows + i] * A[k];
    std::copy_n(column.begin(), rows, A);
  }
}

void add_block_stiffness(const BlockShape& shape, const double* J, const double* v, double weight, double& along,
                         double& scale) {
  std::array<double, kMaxRows> Jv{};
  for (int s = 0; s < shape.arity; J += shape.dim * shape.dofs[s], ++s) {
    if (shape.offset[s] < 0) continue;
    const double *part = v + shape.offset[s], *entry = J;
    for (int k = 0; k < shape.dofs[s]; ++k)
      for (int i = 0; i < shape.dim; ++i, ++entry) {
        const double moved = *entry * part[k];
        Jv[std::size_t(i)] += moved;
        scale += weight * moved * moved;
      }
  }
  for (const double x : Jv) along += weight * x * x;
}

}  // namespace tandem::detail
