#pragma once

#include <algorithm>

#include <tandem/problem/block_kernels.hpp>
#include <tandem/problem/function_ref.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem::detail {

/// Location of the second derivatives of a pair of states (a, b) in the values of the Hessian.
struct HessianPlace {
  HessianPlace() = default;
  HessianPlace(int position, int stride, bool transposed)
      : position(position), stride(static_cast<unsigned>(stride) & 0x7fffffffu), transposed(transposed) {}

  int position = -1;            ///< index of the block's first entry
  unsigned stride : 31 = 0;     ///< distance between the columns of the block
  unsigned transposed : 1 = 0;  ///< the rows are those of state b
};

/// Limits: dofs of one state, rows of one residual, states of one block.
inline constexpr int kMaxDofs = 64, kMaxRows = 64, kMaxStates = 16;

/// Sizes and unknowns of a block. The functions below depend on a residual through this shape only. They are therefore
/// compiled once, or once per number of rows in the inner loops, which keeps the compile time of a problem low. Their
/// common arguments are:
/// - J: Jacobian of each state, dim × dofs of the state, column-major;
/// - charts: Jr(δ) of each state, null if it is the identity;
/// - place: location of each pair of states (a, b ≤ a) at index a (a + 1) / 2 + b;
/// - full: whitening matrix W, column-major, or null if W = diag(diagonal).
struct BlockShape {
  int dim, arity;
  const int *dofs, *offset;  ///< of each state; offset is its first unknown, negative if it is fixed

  int first(int state) const {  ///< first entry of a state in the block's own gradient
    int sum = 0;
    for (int s = 0; s < state; ++s) sum += dofs[s];
    return sum;
  }
  /// Calls f(s) for each free state s.
  template <class F>
  void for_free(F f) const {
    for (int s = 0; s < arity; ++s)
      if (offset[s] >= 0) f(s);
  }
};

/// Computes J ← J Jr(δ), the chain rule through the charts.
template <int dim>
void apply_charts(const BlockShape& shape, const double* const* charts, double* const* J) {
  double product[dim * kMaxDofs];
  shape.for_free([&](int s) {
    if (charts[s]) with_size(shape.dofs[s], [&](auto dof) { multiply_right<dim>(dof, J[s], charts[s], product); });
  });
}

/// Computes A ← W A for a matrix A of `columns` columns.
template <int dim, class N>
TANDEM_INLINED void whiten(N columns, const double* diagonal, const double* full, double* A) {
  if (full)
    multiply_left<dim>(columns, full, A);
  else
    scale_rows<dim>(columns, diagonal, A);
}

/// Computes T = w Jᵀ of each free state, one after the other, and adds T r to the gradient.
template <int dim>
TANDEM_INLINED void add_gradient(const BlockShape& shape, double w, const double* const* J, const double* r, double* T,
                                 double* gradient) {
  for (int s = 0; s < shape.arity; T += dim * shape.dofs[s], ++s) {
    if (shape.offset[s] < 0) continue;
    double* at = gradient + shape.offset[s];
    with_size(shape.dofs[s], [&](auto dof) TANDEM_INLINED_HERE {
      transpose<dim>(dof, w, J[s], T);
      if constexpr (std::is_same_v<decltype(dof), int>)
        add_multiplied(dof, dim, T, r, at);
      else
        add_multiplied<dof()>(std::integral_constant<int, dim>(), T, r, at);
    });
  }
}

/// Adds T_A J_B to the Hessian for each pair of free states (A, B), with T as computed by add_gradient().
template <int dim>
TANDEM_INLINED void add_products_inlined(const BlockShape& shape, const HessianPlace* place, const double* T,
                                         const double* const* J, double* H) {
  const int* offset = shape.offset;
  const double* T_A = T;
  for (int A = 0; A < shape.arity; T_A += dim * shape.dofs[A], place += A + 1, ++A) {
    if (offset[A] < 0) continue;
    const double* T_B = T;
    for (int B = 0; B <= A; T_B += dim * shape.dofs[B], ++B) {
      if (offset[B] < 0) continue;
      const int stride = int(place[B].stride);
      double* to = H + place[B].position;
      const bool twice = A != B && offset[A] == offset[B];  // the block reads one variable twice: both triangles
      for (int turn = 0; turn <= int(twice); ++turn) {
        const bool transposed = place[B].transposed || turn > 0;
        const int rows = shape.dofs[transposed ? B : A], columns = shape.dofs[transposed ? A : B];
        const double* of_rows = transposed ? T_B : T_A;
        const double* of_columns = J[transposed ? A : B];
        if (rows == 6 && columns == 6)  // two SE(3) states, the most frequent case
          add_product<6, dim>(std::integral_constant<int, 6>(), of_rows, of_columns, to, stride);
        else if (rows == 6)
          add_product<6, dim>(columns, of_rows, of_columns, to, stride);
        else if (rows == 3)
          add_product<3, dim>(columns, of_rows, of_columns, to, stride);
        else
          add_product<dim>(rows, columns, of_rows, of_columns, to, stride);
      }
    }
  }
}

/// Numbers of rows whose kernels are compiled for every instruction set. Rare ones are not, to save compile time.
template <int dim>
inline constexpr bool kDispatched = dim == 1 || dim == 2 || dim == 3 || dim == 6;

template <int dim>
void add_products(const BlockShape& shape, const HessianPlace* place, const double* T, const double* const* J,
                  double* H) {
  const auto add = [&]() TANDEM_INLINED_HERE { add_products_inlined<dim>(shape, place, T, J, H); };
  if constexpr (kDispatched<dim>)
    dispatch_simd(add);
  else
    add();
}

/// Noise and loss of a block.
struct BlockWeight {
  const double* diagonal;  ///< 1/σ of each row
  const double* full;      ///< whitening matrix W, or null if it is diagonal
  Loss loss;
};

/// Whitens the rows r of a soft block in place and returns its loss. Bitwise equal to that of add_soft_block().
template <int dim>
TANDEM_INLINED Loss::Value loss_of_rows(const BlockWeight& weight, double* r) {
  whiten<dim>(1, weight.diagonal, weight.full, r);
  return weight.loss(squared_norm<dim>(r));
}
/// Returns the cost of a soft block. Whitens its rows r in place.
template <int dim>
double soft_block_cost(const BlockWeight& weight, double* r) {
  const auto cost = [&]() TANDEM_INLINED_HERE { return 0.5 * loss_of_rows<dim>(weight, r).rho; };
  if constexpr (kDispatched<dim>)
    return dispatch_simd(cost);
  else
    return cost();
}

/// Linearization of a block.
struct LinearizedBlock {
  double* r;           ///< rows
  double* const* J;    ///< Jacobian of each state
  double* transposed;  ///< scratch of the size of all Jacobians
};

/// Whitens the rows and the Jacobians of the free states in place. Returns the loss.
template <int dim>
TANDEM_INLINED Loss::Value whiten_block(const BlockShape& shape, const BlockWeight& weight,
                                        const LinearizedBlock& block) {
  const Loss::Value value = loss_of_rows<dim>(weight, block.r);
  for (int s = 0; s < shape.arity; ++s) {
    if (shape.offset[s] < 0) continue;
    double* J = block.J[s];
    with_size(shape.dofs[s], [&](auto dof) TANDEM_INLINED_HERE { whiten<dim>(dof, weight.diagonal, weight.full, J); });
  }
  return value;
}

template <int dim>
TANDEM_INLINED double add_soft_block_inlined(const BlockShape& shape, const HessianPlace* place,
                                             const BlockWeight& weight, const LinearizedBlock& block, double* gradient,
                                             double* H) {
  const Loss::Value value = whiten_block<dim>(shape, weight, block);
  add_gradient<dim>(shape, value.d1, block.J, block.r, block.transposed, gradient);
  if (H) add_products_inlined<dim>(shape, place, block.transposed, block.J, H);
  return 0.5 * value.rho;
}
/// Adds a soft block to the gradient and, if H is not null, to the Gauss-Newton Hessian. Returns its cost. Whitens r
/// and J in place.
template <int dim>
double add_soft_block(const BlockShape& shape, const HessianPlace* place, const BlockWeight& weight,
                      const LinearizedBlock& block, double* gradient, double* H) {
  const auto add = [&]() TANDEM_INLINED_HERE {
    return add_soft_block_inlined<dim>(shape, place, weight, block, gradient, H);
  };
  if constexpr (kDispatched<dim>)
    return dispatch_simd(add);
  else
    return add();
}

/// Adds the part of a soft block's exact Hessian that needs only first derivatives: gauss_newton_factor ρ' JᵀJ + 2
/// loss_factor ρ'' Jᵀr rᵀJ. Whitens r and J in place.
template <int dim>
TANDEM_INLINED void add_first_order_inlined(const BlockShape& shape, const HessianPlace* place,
                                            const BlockWeight& weight, const LinearizedBlock& block,
                                            double gauss_newton_factor, double loss_factor, double* H) {
  const Loss::Value value = whiten_block<dim>(shape, weight, block);
  double* T = block.transposed;
  for (int s = 0; s < shape.arity; T += dim * shape.dofs[s], ++s) {
    if (shape.offset[s] < 0) continue;
    const double* J = block.J[s];
    with_size(shape.dofs[s], [&](auto dof) TANDEM_INLINED_HERE {
      double g[kMaxDofs];
      multiply_transposed<dim>(dof, J, block.r, g);
      transpose<dim>(dof, gauss_newton_factor * value.d1, J, T);
      for (int k = 0; k < dim; ++k)
        for (int j = 0; j < dof; ++j) T[k * dof + j] += 2 * loss_factor * value.d2 * g[j] * block.r[k];
    });
  }
  add_products_inlined<dim>(shape, place, block.transposed, block.J, H);
}
template <int dim>
void add_first_order(const BlockShape& shape, const HessianPlace* place, const BlockWeight& weight,
                     const LinearizedBlock& block, double gauss_newton_factor, double loss_factor, double* H) {
  const auto add = [&]() TANDEM_INLINED_HERE {
    add_first_order_inlined<dim>(shape, place, weight, block, gauss_newton_factor, loss_factor, H);
  };
  if constexpr (kDispatched<dim>)
    dispatch_simd(add);
  else
    add();
}

/// The kernels above for `dim` rows. block.cpp instantiates those that are kDispatched.
#define TANDEM_BLOCK_KERNELS(instantiation, dim)                                                                    \
  instantiation void add_products<dim>(const BlockShape&, const HessianPlace*, const double*, const double* const*, \
                                       double*);                                                                    \
  instantiation double soft_block_cost<dim>(const BlockWeight&, double*);                                           \
  instantiation double add_soft_block<dim>(const BlockShape&, const HessianPlace*, const BlockWeight&,              \
                                           const LinearizedBlock&, double*, double*);                               \
  instantiation void add_first_order<dim>(const BlockShape&, const HessianPlace*, const BlockWeight&,               \
                                          const LinearizedBlock&, double, double, double*)

TANDEM_BLOCK_KERNELS(extern template, 1);
TANDEM_BLOCK_KERNELS(extern template, 2);
TANDEM_BLOCK_KERNELS(extern template, 3);
TANDEM_BLOCK_KERNELS(extern template, 6);

/// Computes the gradient of factor · cost with respect to the rows: w = factor ρ' WᵀW r.
void soft_block_dual(int dim, const BlockWeight& weight, double factor, const double* r, double* w);
/// Computes Jᵀ w for the free states, through the charts. J is with respect to perturbations of the point.
void block_gradient(const BlockShape& shape, const double* const* J, const double* const* charts, const double* w,
                    double* gradient);
/// Step for central differences of first derivatives; balances truncation h² and rounding 1e-16/h.
inline constexpr double kGradientStep = 1e-5;
/// Adds the Hessian of a block by central differences of its gradient. near(state, k, step, gradient) computes the
/// gradient with entry k of the state's δ moved by `step`.
void add_difference_hessian(const BlockShape& shape, const HessianPlace* place,
                            FunctionRef<void(int state, int k, double step, double* gradient)> near, double* H);
/// Adds second derivatives C of a block to the Hessian, through the charts to first order. C is symmetric and covers
/// the dofs of all states. Also adds Jᵀ w to `gradient`, which the second order of the charts needs. J and C are with
/// respect to perturbations of the point.
void add_block_curvature(const BlockShape& shape, const HessianPlace* place, const double* const* J,
                         const double* const* charts, const double* w, const double* C, double* gradient, double* H);
/// Computes A ← W A; sizes at run time.
void whiten(int rows, int columns, const double* diagonal, const double* full, double* A);
/// Adds weight ‖J v‖² to `along` and weight ‖J diag(v)‖² to `scale`. J is laid out as by PoolBase::linearize_block().
void add_block_stiffness(const BlockShape& shape, const double* J, const double* v, double weight, double& along,
                         double& scale);

}  // namespace tandem::detail
