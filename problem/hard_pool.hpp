#pragma once

#include <algorithm>
#include <cmath>
#include <memory>

#include <tandem/problem/pool.hpp>
#include <tandem/residuals/bounds.hpp>

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

template <Residual R>
class HardPool final : public BlockPool<R, HardPoolBase> {
  using Pool = BlockPool<R, HardPoolBase>;
  using Pool::kArity, Pool::kDim, Pool::kPairs;
  using typename Pool::Jacobians, typename Pool::Row;

 public:
  explicit HardPool(const typename Pool::Stores& stores) : Pool(stores) {}

  void add(const R& residual, const std::array<int, kArity>& slots, const Bounds<kDim>& bounds) {
    this->add_block(residual, slots);
    this->add_bounds(bounds.lower.data(), bounds.upper.data());
  }

  std::unique_ptr<HardPoolBase> new_empty(const StoreMapping& mapping) const override {
    return std::make_unique<HardPool>(this->stores_of(mapping));
  }
  void values(const PoolPlacement& place, int begin, int end, double* c) const override {
    Row r;
    for (int k = begin; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      this->value(i, r);
      std::copy_n(r.data(), kDim, c + i * kDim);
    }
  }
  void jacobian(const PoolPlacement& place, int begin, int end, double* c, double* values) const override {
    Row r;
    Jacobians J;
    Pool::set_zero(J);  // avoids a false warning of GCC 12
    const auto columns = Pool::data(J);
    for (int k = begin; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      const int* offset = &place.offset[i * kArity];
      this->linearize(i, offset, r, J);
      if (c) std::copy_n(r.data(), kDim, c + i * kDim);
      double* out = values + place.jacobian[i];
      for (std::size_t s = 0; s < kArity; ++s)
        if (offset[s] >= 0) out = std::copy_n(columns[s], kDim * Pool::kDofs[s], out);
    }
  }

  void accumulate(const PoolPlacement& place, int begin, int end, const double* weights, const double* jacobian,
                  double* H) const override {
    typename Pool::Transposed transposed;
    std::array<const double*, std::size_t(kArity)> columns{};  // as stored by jacobian()
    for (int k = begin; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      const double* w = weights + i * kDim;
      if (std::all_of(w, w + kDim, [](double x) { return x == 0; })) continue;
      const BlockShape shape = Pool::shape(&place.offset[i * kArity]);
      const double* from = jacobian + place.jacobian[i];
      double* T = transposed.data();
      for (int s = 0; s < kArity; T += kDim * Pool::kDofs[s], ++s) {
        if (shape.offset[s] < 0) continue;
        const int dof = Pool::kDofs[s];
        columns[s] = from;
        for (int row = 0; row < kDim; ++row)
          for (int j = 0; j < dof; ++j) T[row * dof + j] = w[row] * from[j * kDim + row];
        from += kDim * dof;
      }
      add_products<kDim>(shape, &place.hessian[i * kPairs], transposed.data(), columns.data(), H);
    }
  }
  void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature, double factor,
                         const double* multipliers, double* gradient, double* H) const override {
    if constexpr (IsLinear<R>) return;
    Row r;
    Jacobians J;
    Pool::set_zero(J);
    for (int k = begin; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      const double* lambda = multipliers + i * kDim;
      if (std::all_of(lambda, lambda + kDim, [](double l) { return l == 0; })) continue;
      const auto dual = [&](const Row&, Row& w) {
        for (int row = 0; row < kDim; ++row) w.data()[row] = factor * lambda[row];
      };
      const int* offset = &place.offset[i * kArity];
      this->add_second_derivatives(i, offset, &place.hessian[i * kPairs], dual, r, J, gradient, H);
    }
  }
};

}  // namespace tandem::detail
