#pragma once

#include <algorithm>

#include <tandem/problem/pool.hpp>
#include <tandem/residuals/bounds.hpp>

namespace tandem::detail {

/// Blocks that are constraints: lower ≤ r ≤ upper. Block i has rows i·dim … (i + 1)·dim − 1 of its pool.
class HardPoolBase : public PoolBase {
 public:
  virtual void bounds(double* lower, double* upper) const = 0;
  /// Rows at the point.
  virtual void values(double* c) const = 0;
  /// Rows, where `c` is not null, and nonzeros at the point: of each block its states' Jacobians one after the other,
  /// each column by column.
  virtual void jacobian(const PoolPlacement& place, double* c, double* values) const = 0;
  /// Adds Jᵀ diag(weights) J to the Hessian.
  virtual void accumulate(const PoolPlacement& place, const double* weights, double* H) const = 0;
  /// The same with J as jacobian() gave it.
  virtual void accumulate(const PoolPlacement& place, const double* weights, const double* jacobian,
                          double* H) const = 0;
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
    bounds_.push_back(bounds);
  }
  void remove(int i) override {
    this->remove_block(i);
    this->remove_from(bounds_, i);
  }

  void bounds(double* lower, double* upper) const override {
    for (const auto& b : bounds_) {
      lower = std::copy_n(b.lower.data(), kDim, lower);
      upper = std::copy_n(b.upper.data(), kDim, upper);
    }
  }
  void values(double* c) const override {
    Row r;
    for (std::size_t i = 0; i < this->residuals_.size(); ++i) {
      this->value(i, r);
      c = std::copy_n(r.data(), kDim, c);
    }
  }
  void jacobian(const PoolPlacement& place, double* c, double* values) const override {
    Row r;
    Jacobians J;
    static_for<kArity>([&]<int A>() { std::get<A>(J).setZero(); });  // GCC 12 does not see that linearize sets it
    for (std::size_t i = 0; i < this->residuals_.size(); ++i) {
      const int* offset = &place.offset[i * kArity];
      this->linearize(i, offset, r, J);
      if (c) c = std::copy_n(r.data(), kDim, c);
      double* out = values + place.jacobian[i];
      static_for<kArity>([&]<int S>() {
        if (offset[S] >= 0) out = std::copy_n(std::get<S>(J).data(), std::get<S>(J).size(), out);
      });
    }
  }

  void accumulate(const PoolPlacement& place, const double* weights, double* H) const override {
    each_weighted(place, weights, [&](std::size_t i, const int* offset, const Jacobians& J) {
      this->add_products(offset, &place.hessian[i * kPairs], 1.0, J, H);
    });
  }
  void accumulate(const PoolPlacement& place, const double* weights, const double* jacobian, double* H) const override {
    Jacobians J;
    static_for<kArity>([&]<int A>() { std::get<A>(J).setZero(); });
    for (std::size_t i = 0; i < this->residuals_.size(); ++i) {
      const int* offset = &place.offset[i * kArity];
      const Row root = Eigen::Map<const Row>(weights + i * kDim).cwiseSqrt();
      if (root.isZero(0.)) continue;
      const double* from = jacobian + place.jacobian[i];
      static_for<kArity>([&]<int A>() {
        if (offset[A] < 0) return;
        auto& Ja = std::get<A>(J);
        Ja = root.asDiagonal() * Eigen::Map<const std::decay_t<decltype(Ja)>>(from);
        from += Ja.size();
      });
      this->add_products(offset, &place.hessian[i * kPairs], 1.0, J, H);
    }
  }
  void add_stiffness(const PoolPlacement& place, const double* v, const double* weights, double& along,
                     double& scale) const override {
    each_weighted(place, weights, [&](std::size_t, const int* offset, const Jacobians& J) {
      this->add_block_stiffness(offset, J, v, along, scale);
    });
  }

  void add_exact_hessian(const PoolPlacement& place, double factor, const double* multipliers,
                         double* H) const override {
    for (std::size_t i = 0; i < this->residuals_.size(); ++i) {
      const Row lambda = factor * Eigen::Map<const Row>(multipliers + i * kDim);
      if (lambda.isZero(0.)) continue;
      const auto gradient = [&]<int A>(const Row&, const Jacobians& J) {
        return (std::get<A>(J).transpose() * lambda).eval();
      };
      this->difference_gradient(i, &place.offset[i * kArity], &place.hessian[i * kPairs], gradient, H);
    }
  }

 private:
  /// Calls f(block, offsets, J) with each row of J times the root of its weight.
  template <class F>
  void each_weighted(const PoolPlacement& place, const double* weights, F f) const {
    Row r;
    Jacobians J;
    static_for<kArity>([&]<int A>() { std::get<A>(J).setZero(); });
    for (std::size_t i = 0; i < this->residuals_.size(); ++i) {
      const int* offset = &place.offset[i * kArity];
      const Row root = Eigen::Map<const Row>(weights + i * kDim).cwiseSqrt();
      if (root.isZero(0.)) continue;
      this->linearize(i, offset, r, J);
      static_for<kArity>([&]<int A>() { std::get<A>(J).array().colwise() *= root.array(); });
      f(i, offset, J);
    }
  }

  std::vector<Bounds<kDim>> bounds_;
};

}  // namespace tandem::detail
