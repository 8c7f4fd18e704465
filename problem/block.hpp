#pragma once

#include <algorithm>

#include <tandem/problem/block_kernels.hpp>
#include <tandem/problem/function_ref.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem::detail {

/// Where the second derivatives of a pair of states (a, b) go in the solver's matrix.
struct HessianPlace {
  HessianPlace() = default;
  HessianPlace(int position, int stride, bool transposed)
      : position(position), stride(static_cast<unsigned>(stride)), transposed(transposed) {}

  int position = -1;            ///< of the block's first entry in the Hessian's values
  unsigned stride : 31 = 0;     ///< from one column of it to the next
  unsigned transposed : 1 = 0;  ///< whether its rows are those of b, not a
};

/// Of one state, of one residual, and of one block.
inline constexpr int kMostDofs = 64, kMostRows = 64, kMostStates = 16;

/// The sizes of a block. What needs no more of a residual is compiled once, or, in the solvers' loops, once for each number
/// of rows: it is most of what there is to compile. J: of each state its Jacobian, rows × its dofs, by columns; charts: of
/// each state Jr(δ), or null where it is the identity; place: of each pair of states (a, b ≤ a) at a (a + 1) / 2 + b.
struct BlockShape {
  int dim, arity;
  const int *dofs, *offset;  ///< of each state; offset: its first unknown, negative when it is fixed

  int first(int state) const {  ///< of the state's entries in the block's own gradient
    int sum = 0;
    for (int s = 0; s < state; ++s) sum += dofs[s];
    return sum;
  }
  /// f(s) for each state that is not fixed.
  template <class F>
  void for_free(F f) const {
    for (int s = 0; s < arity; ++s)
      if (offset[s] >= 0) f(s);
  }
};

/// J ← J Jr(δ), the chain through the charts, here and nowhere else in a solver's loop.
template <int dim>
void through_charts(const BlockShape& shape, const double* const* charts, double* const* J) {
  double product[dim * kMostDofs];
  shape.for_free([&](int s) {
    if (charts[s]) with_size(shape.dofs[s], [&](auto dof) { multiply_right<dim>(dof, J[s], charts[s], product); });
  });
}

/// A ← W A of so many columns, W a diagonal or, where it is not null, full.
template <int dim, class N>
TANDEM_INLINED void whiten(N columns, const double* diagonal, const double* full, double* A) {
  if (full)
    multiply_left<dim>(columns, full, A);
  else
    scale_rows<dim>(columns, diagonal, A);
}

/// T ← w Jᵀ of each free state, one after the other, and gradient += T r.
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

/// H += T_A J_B for every pair of free states, straight into the solver's matrix; T as add_gradient() leaves it.
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
      const bool twice = A != B && offset[A] == offset[B];  // where a block reads one variable twice, both
      for (int turn = 0; turn <= int(twice); ++turn) {
        const bool transposed = place[B].transposed || turn > 0;
        const int rows = shape.dofs[transposed ? B : A], columns = shape.dofs[transposed ? A : B];
        const double* of_rows = transposed ? T_B : T_A;
        const double* of_columns = J[transposed ? A : B];
        if (rows == 6 && columns == 6)  // of two poses, in space: most of what there is
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

/// The numbers of rows for which a block's arithmetic is compiled for each instruction set: not for seldom ones, since that
/// would be once more for each residual.
template <int dim>
inline constexpr bool kDispatched = dim == 1 || dim == 2 || dim == 3 || dim == 6;

template <int dim>
void add_products(const BlockShape& shape, const HessianPlace* place, const double* T, const double* const* J,
                  double* H) {
  const auto add = [&]() TANDEM_INLINED_HERE { add_products_inlined<dim>(shape, place, T, J, H); };
  if constexpr (kDispatched<dim>)
    at_best(add);
  else
    add();
}

/// A block's noise, 1/σ of each row or, where it is not null, W by columns, and its loss.
struct BlockWeight {
  const double* diagonal;
  const double* full;
  Loss loss;
};

/// A soft block's cost, of its rows, which are whitened in their place: to the last bit what add_soft_block() gives.
template <int dim>
TANDEM_INLINED Loss::Value loss_of_rows(const BlockWeight& weight, double* r) {
  whiten<dim>(1, weight.diagonal, weight.full, r);
  return weight.loss(squared_norm<dim>(r));
}
template <int dim>
double soft_block_cost(const BlockWeight& weight, double* r) {
  const auto cost = [&]() TANDEM_INLINED_HERE { return 0.5 * loss_of_rows<dim>(weight, r).rho; };
  if constexpr (kDispatched<dim>)
    return at_best(cost);
  else
    return cost();
}

/// A block's rows, its states' Jacobians, and room for these once more.
struct LinearizedBlock {
  double* r;
  double* const* J;
  double* transposed;
};

/// Whitens a soft block's rows and the Jacobians of its free states in their place; its loss.
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
/// Adds a soft block to the gradient and, where it is not null, to the Hessian; r and J are whitened in their place. Its cost.
template <int dim>
double add_soft_block(const BlockShape& shape, const HessianPlace* place, const BlockWeight& weight,
                      const LinearizedBlock& block, double* gradient, double* H) {
  const auto add = [&]() TANDEM_INLINED_HERE {
    return add_soft_block_inlined<dim>(shape, place, weight, block, gradient, H);
  };
  if constexpr (kDispatched<dim>)
    return at_best(add);
  else
    return add();
}

/// Of a soft block's exact second derivatives those that are not its rows' own: adds squares ρ' Jᵀ J + of_loss 2ρ'' Jᵀ r rᵀ J;
/// r and J are whitened in their place.
template <int dim>
TANDEM_INLINED void add_first_order_inlined(const BlockShape& shape, const HessianPlace* place,
                                            const BlockWeight& weight, const LinearizedBlock& block, double squares,
                                            double of_loss, double* H) {
  const Loss::Value value = whiten_block<dim>(shape, weight, block);
  double* T = block.transposed;
  for (int s = 0; s < shape.arity; T += dim * shape.dofs[s], ++s) {
    if (shape.offset[s] < 0) continue;
    const double* J = block.J[s];
    with_size(shape.dofs[s], [&](auto dof) TANDEM_INLINED_HERE {
      double g[kMostDofs];
      multiply_transposed<dim>(dof, J, block.r, g);
      transpose<dim>(dof, squares * value.d1, J, T);
      for (int k = 0; k < dim; ++k)
        for (int j = 0; j < dof; ++j) T[k * dof + j] += 2 * of_loss * value.d2 * g[j] * block.r[k];
    });
  }
  add_products_inlined<dim>(shape, place, block.transposed, block.J, H);
}
template <int dim>
void add_first_order(const BlockShape& shape, const HessianPlace* place, const BlockWeight& weight,
                     const LinearizedBlock& block, double squares, double of_loss, double* H) {
  const auto add = [&]() TANDEM_INLINED_HERE {
    add_first_order_inlined<dim>(shape, place, weight, block, squares, of_loss, H);
  };
  if constexpr (kDispatched<dim>)
    at_best(add);
  else
    add();
}

/// All of these of so many rows, which block.cpp instantiates for what is kDispatched.
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

/// w = factor ρ' Wᵀ W r, which a soft block's rows are weighted with in the cost's gradient.
void soft_block_dual(int dim, const BlockWeight& weight, double factor, const double* r, double* w);
/// Jᵀ w over the states that are not fixed, J with respect to perturbations of the point and through the charts.
void block_gradient(const BlockShape& shape, const double* const* J, const double* const* charts, const double* w,
                    double* gradient);
/// Step of a central difference of first derivatives: balances h² truncation and 1e-16/h rounding.
inline constexpr double kGradientStep = 1e-5;
/// Adds the block's Hessian, by central differences of its gradient: `near(state, k, step, gradient)` gives the gradient
/// where entry k of the state's δ has moved by `step`.
void add_difference_hessian(const BlockShape& shape, const HessianPlace* place,
                            FunctionRef<void(int state, int k, double step, double* gradient)> near, double* H);
/// Adds a block's own second derivatives C, of all its states' dofs and symmetric, to the Hessian, through the charts to
/// first order, and Jᵀ w to the gradient that the charts' second order applies to, J with respect to perturbations of the
/// point.
void add_block_curvature(const BlockShape& shape, const HessianPlace* place, const double* const* J,
                         const double* const* charts, const double* w, const double* C, double* gradient, double* H);
/// A ← W A, as the template.
void whiten(int rows, int columns, const double* diagonal, const double* full, double* A);
/// Adds weight ‖J v‖² and weight ‖J diag(v)‖²; J as PoolBase::linearize_block() gives it.
void add_block_stiffness(const BlockShape& shape, const double* J, const double* v, double weight, double& along,
                         double& scale);

}  // namespace tandem::detail
