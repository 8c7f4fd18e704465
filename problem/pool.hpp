#pragma once

#include <algorithm>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/problem/block.hpp>
#include <tandem/problem/state_store.hpp>

namespace tandem::detail {

/// Maps a state store to the store of the same group in another problem. A pool calls it for each state in order.
using StoreMapping = std::function<StateStoreBase*(const StateStoreBase*)>;

/// Locations of the blocks of a pool in the arrays of a solver; computed once by NlpEvaluator.
struct PoolPlacement {
  std::vector<int> offset;            ///< Blocks × arity: first unknown of the state, −1 if fixed.
  std::vector<HessianPlace> hessian;  ///< Blocks × arity (arity + 1) / 2: pair (a, b ≤ a) at a (a + 1) / 2 + b.
  std::vector<int> jacobian;          ///< Blocks: first value in the constraint Jacobian (hard pools only).
  std::vector<int> order;             ///< Blocks in the order of evaluation; empty if that is their own order.

  /// Returns the block at position k in the order of evaluation.
  int at(int k) const { return order.empty() ? k : order[static_cast<std::size_t>(k)]; }
};

/// Selects the exact Hessian, or the exact minus the Gauss-Newton Hessian.
enum class Curvature { all, beyond_gauss_newton };

/// All blocks of one residual type and role. They are stored contiguously and evaluated in one loop, with one virtual
/// call per pool.
class PoolBase {
 public:
  virtual ~PoolBase() = default;
  virtual std::string_view name() const = 0;
  virtual int dim() const = 0;
  virtual int arity() const = 0;
  virtual int size() const = 0;
  /// Returns the arity() IDs of the variables that block i reads.
  virtual const int* variables(int i) const = 0;
  /// Returns whether block i reads a marked variable; `marked` is indexed by ID.
  bool reads(int i, const std::vector<char>& marked) const {
    const int* ids = variables(i);
    return std::any_of(ids, ids + arity(), [&](int id) { return marked[static_cast<std::size_t>(id)] != 0; });
  }
  /// Removes block i. The last block takes its index.
  virtual void remove(int i) = 0;
  /// Adds a copy of block i of `from`, a pool of the same residual type and role, that reads the states at `slots`.
  virtual void add_copy(const PoolBase& from, int i, const int* slots) = 0;
  /// Returns the residual object of block i.
  virtual const void* residual(int i) const = 0;
  /// Appends a residual without noise, loss or bounds; the caller must add those.
  virtual void add_residual(const void* residual, const int* slots) = 0;
  /// Sets x to the points of the states that block i reads. Valid until a variable is added or the point changes.
  virtual void points(int i, const void** x) const = 0;
  /// Replaces the residual of block i by one of the same type.
  virtual void set_residual(int i, const void* residual) = 0;
  /// Computes the rows of block i at the point, in the units of the residual.
  virtual void evaluate_block(int i, double* r) const = 0;
  /// Also computes the Jacobians of all states, one after the other. Jacobians of states with a negative offset are 0.
  /// If `offset` is null, all states count as free.
  virtual void linearize_block(int i, const int* offset, double* r, double* J) const = 0;
  /// Returns the tangent dimension of each state.
  virtual const int* dofs() const = 0;
  /// Adds ‖W J v‖² to `along` and ‖W J diag(v)‖² to `scale` over all blocks. Hard pools use `row_weights` as the
  /// squares of the diagonal of W; soft pools use their noise and loss.
  virtual void add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                             double& scale) const = 0;
  /// Adds the exact Hessian of factor · cost (soft pools) or multipliersᵀ c (hard pools) of the blocks begin … end − 1
  /// in the order of evaluation.
  ///
  /// If the residual implements second derivatives, the result excludes the second derivatives of the charts.
  /// StateStoreBase::add_chart_curvature() computes them from `gradient`, to which this function adds the gradient with
  /// respect to perturbations of the point. Otherwise the Hessian is a central difference of the closed-form gradient
  /// and includes the charts.
  virtual void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                                 const double* multipliers, double* gradient, double* H) const = 0;

 protected:
  /// Removes entry i. The last entry takes its index.
  template <class T>
  static void remove_from(std::vector<T>& v, int i) {
    v[static_cast<std::size_t>(i)] = v.back();
    v.pop_back();
  }
};

/// Rethrows the current exception of a residual, an Error, as an UndefinedResidualError with the names of the residual
/// and of its states. Rethrows a StaleHandleError and Stopped unchanged. Call it in a catch clause.
[[noreturn]] void rethrow_undefined(std::string_view residual, std::span<const StateStoreBase* const> stores,
                                    const int* slots);

}  // namespace tandem::detail
