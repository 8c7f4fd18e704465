#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <tandem/problem/block_pool.hpp>

namespace tandem::detail {

/// Constraint blocks lower ≤ r ≤ upper of one residual type. Block i has rows i·dim … (i + 1)·dim − 1 of the pool.
class HardPoolBase : public PoolBase {
 public:
  /// Returns an empty pool of the same residual type over other stores.
  virtual std::unique_ptr<HardPoolBase> new_empty(const StoreMapping& mapping) const = 0;
  const std::vector<double>& lower() const { return lower_; }
  const std::vector<double>& upper() const { return upper_; }
  /// Returns the Lagrange multipliers of all rows: those of the last solve, 0 for new blocks.
  const std::vector<double>& multipliers() const { return multipliers_; }
  void set_multipliers(int i, const double* multipliers);
  void set_bounds(int i, const double* lower, const double* upper);
  /// Appends the bounds of the block that was added last.
  void add_bounds(const double* lower, const double* upper);

  // The following methods process blocks begin … end − 1 in the order of evaluation. Arrays cover all rows of the pool.

  /// Computes the rows at the point.
  virtual void values(const PoolPlacement& place, int begin, int end, double* c) const = 0;
  /// Computes the values of the Jacobian at the point and, if `c` is not null, the rows. Each block stores the
  /// Jacobians of its free states one after the other, column-major.
  virtual void jacobian(const PoolPlacement& place, int begin, int end, double* c, double* values) const = 0;
  /// Adds Jᵀ diag(weights) J to the Hessian, with J as computed by jacobian().
  virtual void accumulate(const PoolPlacement& place, int begin, int end, const double* weights, const double* jacobian,
                          double* H) const = 0;

  void remove(int i) final;
  void add_copy(const PoolBase& from, int i, const int* slots) final;
  void add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                     double& scale) const final;

 protected:
  /// Removes the residual of block i.
  virtual void remove_residual(int i) = 0;

 private:
  std::vector<double> lower_, upper_, multipliers_;  // dim() entries per block
  mutable Eigen::VectorXd r_, J_, root_;             // scratch of add_stiffness()
};

/// Implements the loops over the constraint blocks of one residual type.
class HardPool final : public BlockPool<HardPoolBase> {
 public:
  HardPool(const ResidualFunctions& functions, std::span<StateStoreBase* const> stores)
      : BlockPool(functions, stores) {}

  void add(const void* residual, const int* slots, const double* lower, const double* upper) {
    add_residual(residual, slots);
    add_bounds(lower, upper);
  }
  std::unique_ptr<HardPoolBase> new_empty(const StoreMapping& mapping) const override;
  void values(const PoolPlacement& place, int begin, int end, double* c) const override;
  void jacobian(const PoolPlacement& place, int begin, int end, double* c, double* values) const override;
  void accumulate(const PoolPlacement& place, int begin, int end, const double* weights, const double* jacobian,
                  double* H) const override;
  void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                         const double* multipliers, double* gradient, double* H) const override;
};

}  // namespace tandem::detail
