#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include <tandem/problem/pool.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem::detail {

/// Blocks that are costs: ½ Σ ρ(‖W r‖²).
class SoftPoolBase : public PoolBase {
 public:
  /// Cost of blocks begin … end − 1 at the point.
  virtual double cost(int begin, int end) const = 0;
  /// Cost of one block at the point.
  virtual double block_cost(int i) const = 0;
  /// The same; adds the gradient and, where H is not null, the Gauss-Newton Hessian ρ' Jᵀ WᵀW J.
  virtual double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const = 0;
  /// ρ'(s) of one block at the point.
  virtual double weight(int i) const = 0;
  /// The least factor on the scales of the losses with which all are convex at the point; empty when none is robust.
  virtual std::optional<double> convex_widening() const = 0;

  double widening = 1.0;  ///< factor on the scale of every loss
};

template <Residual R>
class SoftPool final : public BlockPool<R, SoftPoolBase> {
  using Pool = BlockPool<R, SoftPoolBase>;
  using Pool::kArity, Pool::kDim, Pool::kPairs;
  using typename Pool::Jacobians, typename Pool::Row;

 public:
  explicit SoftPool(const typename Pool::Stores& stores) : Pool(stores) {}

  void add(const R& residual, const std::array<int, kArity>& slots, const Gaussian& noise, const Loss& loss) {
    this->add_block(residual, slots);
    Weight w{noise.diagonal(), -1, loss};
    if (!noise.is_diagonal()) {
      if (free_full_.empty()) {
        free_full_.push_back(static_cast<int>(full_.size()));
        full_.emplace_back();
      }
      w.full = free_full_.back();
      free_full_.pop_back();
      full_[std::size_t(w.full)] = noise.sqrt_information();
    }
    weights_.push_back(w);
  }
  void remove(int i) override {
    if (const int full = weights_[std::size_t(i)].full; full >= 0) free_full_.push_back(full);
    this->remove_block(i);
    this->remove_from(weights_, i);
  }

  double cost(int begin, int end) const override {
    double total = 0;
    for (int i = begin; i < end; ++i) total += block_cost(i);
    return total;
  }
  double block_cost(int i) const override {
    Row r;
    this->value(std::size_t(i), r);
    whiten(std::size_t(i), r);
    return 0.5 * loss(std::size_t(i), r).rho;
  }
  double weight(int i) const override {
    Row r;
    this->value(std::size_t(i), r);
    whiten(std::size_t(i), r);
    return loss(std::size_t(i), r).d1;
  }
  std::optional<double> convex_widening() const override {
    std::optional<double> largest;
    Row r;
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const Loss& own = weights_[i].loss;
      if (own.kind == Loss::Kind::none) continue;
      this->value(i, r);
      whiten(i, r);
      largest = std::max(largest.value_or(0.0), r.norm() / (own.scale * std::sqrt(own.convex_until())));
    }
    return largest;
  }

  double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const override {
    double total = 0;
    Row r;
    Jacobians J;
    static_for<kArity>([&]<int A>() { std::get<A>(J).setZero(); });  // GCC 12 does not see that linearize sets it
    for (std::size_t i = std::size_t(begin); i < std::size_t(end); ++i) {
      const int* offset = &place.offset[i * kArity];
      this->linearize(i, offset, r, J);
      whiten(i, r);
      const Loss::Value value = loss(i, r);
      total += 0.5 * value.rho;
      r *= value.d1;
      static_for<kArity>([&]<int A>() {
        if (offset[A] < 0) return;
        auto& Ja = std::get<A>(J);
        whiten(i, Ja);
        Eigen::Map<Vector<Pool::template State<A>::dof>>(gradient + offset[A]).noalias() += Ja.transpose() * r;
      });
      if (H) this->add_products(offset, &place.hessian[i * kPairs], value.d1, J, H);
    }
    return total;
  }

  void add_stiffness(const PoolPlacement& place, const double* v, const double*, double& along,
                     double& scale) const override {
    Row r;
    Jacobians J;
    static_for<kArity>([&]<int A>() { std::get<A>(J).setZero(); });
    for (std::size_t i = 0; i < this->residuals_.size(); ++i) {
      const int* offset = &place.offset[i * kArity];
      this->linearize(i, offset, r, J);
      whiten(i, r);
      const double root = std::sqrt(loss(i, r).d1);
      static_for<kArity>([&]<int A>() {
        if (offset[A] < 0) return;
        whiten(i, std::get<A>(J));
        std::get<A>(J) *= root;
      });
      this->add_block_stiffness(offset, J, v, along, scale);
    }
  }

  void add_exact_hessian(const PoolPlacement& place, double factor, const double*, double* H) const override {
    for (std::size_t i = 0; i < this->residuals_.size(); ++i) {
      const auto gradient = [&]<int A>(const Row& r, const Jacobians& J) {
        Row w = r;
        whiten(i, w);
        const double d1 = loss(i, w).d1;
        unwhiten(i, w);
        return (factor * d1 * std::get<A>(J).transpose() * w).eval();
      };
      this->difference_gradient(i, &place.offset[i * kArity], &place.hessian[i * kPairs], gradient, H);
    }
  }

 private:
  struct Weight {
    Vector<kDim> diagonal;  // 1/σ
    int full;               // index of W in full_, −1 when it is diagonal
    Loss loss;
  };

  /// ρ, ρ', ρ'' at s = ‖r‖² of a whitened residual.
  Loss::Value loss(std::size_t i, const Row& r) const {
    const Loss& own = weights_[i].loss;
    return Loss{own.kind, this->widening * own.scale}(r.squaredNorm());
  }
  template <class M>
  void whiten(std::size_t i, M& m) const {
    const Weight& w = weights_[i];
    if (w.full < 0) {
      m.array().colwise() *= w.diagonal.array();
    } else {
      m = (full_[std::size_t(w.full)] * m).eval();
    }
  }
  void unwhiten(std::size_t i, Row& r) const {  // r = Wᵀ r
    const Weight& w = weights_[i];
    r = w.full < 0 ? Row(w.diagonal.cwiseProduct(r)) : Row(full_[std::size_t(w.full)].transpose() * r);
  }

  std::vector<Weight> weights_;
  std::vector<Matrix<kDim, kDim>> full_;
  std::vector<int> free_full_;  // of removed blocks
};

}  // namespace tandem::detail
