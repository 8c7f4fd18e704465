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

/// Sizes and unknowns of a block. The functions below depend on a residual through this shape only. They are therefore
/// compiled once, which keeps the compile time of a problem low. Their common arguments are:
/// - J: Jacobian of each state, dim × dofs of the state, column-major;
/// - charts: Jr(δ) of each state, null if it is the identity;
/// - place: location of each pair of states (a, b ≤ a) at index a (a + 1) / 2 + b;
/// - full: whitening matrix W, column-major, or null if W = diag(diagonal).
struct BlockShape {
  int dim, arity;
  const int *dofs, *offset;  ///< per state; offset: its first unknown, negative if it is fixed

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

/// Noise and loss of a block.
struct BlockWeight {
  const double* diagonal;  ///< 1/σ of each row
  const double* full;      ///< whitening matrix W, or null if it is diagonal
  Loss loss;
};

/// Linearization of a block.
struct LinearizedBlock {
  double* r;           ///< rows
  double* const* J;    ///< Jacobian of each state
  double* transposed;  ///< scratch of the size of all Jacobians
};

/// Inner loops over the entries of a block. For 1, 2, 3 and 6 rows, they are compiled for this number of rows and for
/// every instruction set.
struct BlockKernels {
  /// Computes J ← J Jr(δ), the chain rule through the charts.
  void (*apply_charts)(const BlockShape& shape, const double* const* charts, double* const* J);
  /// Adds T_A J_B to the Hessian for each pair of free states (A, B). T stores a weighted Jᵀ of each state, one after
  /// the other.
  void (*add_products)(const BlockShape& shape, const HessianPlace* place, const double* T, const double* const* J,
                       double* H);
  /// Returns the cost of a soft block. Whitens its rows r in place. Bitwise equal to that of add_soft_block().
  double (*soft_block_cost)(int dim, const BlockWeight& weight, double* r);
  /// Adds a soft block to the gradient and, if H is not null, to the Gauss-Newton Hessian. Returns its cost. Whitens r
  /// and J in place.
  double (*add_soft_block)(const BlockShape& shape, const HessianPlace* place, const BlockWeight& weight,
                           const LinearizedBlock& block, double* gradient, double* H);
  /// Adds the part of a soft block's exact Hessian that needs only first derivatives: gauss_newton_factor ρ' JᵀJ + 2
  /// loss_factor ρ'' Jᵀr rᵀJ. Whitens r and J in place.
  void (*add_first_order)(const BlockShape& shape, const HessianPlace* place, const BlockWeight& weight,
                          const LinearizedBlock& block, double gauss_newton_factor, double loss_factor, double* H);
};
/// Returns the kernels for a number of rows.
const BlockKernels& block_kernels(int dim);

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
