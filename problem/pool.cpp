#include <algorithm>
#include <array>

#include <tandem/problem/pool.hpp>

namespace tandem::detail {
namespace {

/// Adds a column of the block's Hessian, that of entry k of state B, from the gradients on both sides of it.
void add_hessian_column(const BlockShape& shape, const HessianPlace* place, int B, int k, const double* plus,
                        const double* minus, double* H) {
  const int* offset = shape.offset;
  for (int A = 0; A < shape.arity; ++A) {
    if (offset[A] < 0) continue;
    const int a = std::max(A, B), b = std::min(A, B), first = shape.first(A);
    const HessianPlace& at = place[a * (a + 1) / 2 + b];
    for (int m = 0; m < shape.dofs[A]; ++m) {
      const double column = (plus[first + m] - minus[first + m]) / (2 * kGradientStep);
      // Every ordered pair is met once from each side: half from each keeps the Hessian symmetric.
      if (A == B) {
        H[at.position + k * at.stride + m] += 0.5 * column;
        H[at.position + m * at.stride + k] += 0.5 * column;
      } else {
        const double v = offset[A] == offset[B] ? column : 0.5 * column;
        H[offset[A] >= offset[B] ? at.position + k * at.stride + m : at.position + m * at.stride + k] += v;
      }
    }
  }
}

}  // namespace

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
    double product[kMostDofs];  // chartᵀ (Jᵀ w)
    for (int j = 0; j < dof; ++j) {
      product[j] = 0;
      for (int k = 0; k < dof; ++k) product[j] += charts[s][j * dof + k] * gradient[k];
    }
    std::copy_n(product, dof, gradient);
  }
}

void add_difference_hessian(const BlockShape& shape, const HessianPlace* place,
                            FunctionRef<void(int, int, double, double*)> near, double* H) {
  std::array<double, std::size_t(kMostStates * kMostDofs)> plus, minus;
  for (int B = 0; B < shape.arity; ++B) {
    if (shape.offset[B] < 0) continue;
    for (int k = 0; k < shape.dofs[B]; ++k) {
      near(B, k, kGradientStep, plus.data());
      near(B, k, -kGradientStep, minus.data());
      add_hessian_column(shape, place, B, k, plus.data(), minus.data(), H);
    }
  }
}

void whiten(int rows, int columns, const double* diagonal, const double* full, double* A) {
  for (int j = 0; j < columns; ++j, A += rows) {
    if (!full) {
      for (int i = 0; i < rows; ++i) A[i] *= diagonal[i];
      continue;
    }
    std::array<double, kMostRows> column{};
    for (int k = 0; k < rows; ++k)
      for (int i = 0; i < rows; ++i) column[std::size_t(i)] += full[k * rows + i] * A[k];
    std::copy_n(column.begin(), rows, A);
  }
}

void add_block_stiffness(const BlockShape& shape, const double* J, const double* v, double weight, double& along,
                         double& scale) {
  std::array<double, kMostRows> Jv{};
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
