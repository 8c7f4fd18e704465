#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include <tandem/problem/pool.hpp>
#include <tandem/problem/slots.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem::detail {

/// Blocks that are costs: ½ Σ ρ(‖W r‖²).
class SoftPoolBase : public PoolBase {
 public:
  /// An empty pool of the same residual, over other stores.
  virtual std::unique_ptr<SoftPoolBase> another(const StoreInstead& instead) const = 0;
  /// Cost of blocks begin … end − 1 at the point.
  virtual double cost(int begin, int end) const = 0;
  /// Cost of one block at the point.
  virtual double block_cost(int i) const = 0;
  /// The same; adds the gradient and, where H is not null, the Gauss-Newton Hessian ρ' Jᵀ WᵀW J.
  virtual double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const = 0;
  /// ρ'(s) of one block at the point.
  virtual double weight(int i) const = 0;
  virtual Gaussian noise(int i) const = 0;
  virtual void set_noise(int i, const Gaussian& noise) = 0;
  virtual Loss loss(int i) const = 0;  ///< as given, not widened
  virtual void set_loss(int i, const Loss& loss) = 0;
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
    weights_.push_back({{}, -1, loss});
    set_noise(this->size() - 1, noise);
  }
  std::unique_ptr<SoftPoolBase> another(const StoreInstead& instead) const override {
    auto pool = std::make_unique<SoftPool>(this->stores_of(instead));
    pool->widening = this->widening;
    return pool;
  }
  void add_copy(const PoolBase& from, int i, const int* slots) override {
    const auto& other = static_cast<const SoftPool&>(from);
    this->add_block_of(other, i, slots);
    Weight w = other.weights_[std::size_t(i)];
    if (w.full >= 0) w.full = full_.add(other.full_.at(w.full));
    weights_.push_back(w);
  }
  Gaussian noise(int i) const override {
    const Weight& w = weights_[std::size_t(i)];
    return noise_of_weights(kDim, w.diagonal.data(), w.full < 0 ? nullptr : full_.at(w.full).data());
  }
  void set_noise(int i, const Gaussian& noise) override {
    Weight& w = weights_[std::size_t(i)];
    if (w.full >= 0) full_.remove(std::exchange(w.full, -1));
    if (noise.is_diagonal()) {
      std::copy_n(noise.diagonal().data(), kDim, w.diagonal.begin());
    } else {
      const Eigen::MatrixXd W = noise.sqrt_information();
      w.full = full_.add();
      std::copy_n(W.data(), kDim * kDim, full_.at(w.full).begin());
    }
  }
  Loss loss(int i) const override { return weights_[std::size_t(i)].loss; }
  void set_loss(int i, const Loss& loss) override { weights_[std::size_t(i)].loss = loss; }
  void remove(int i) override {
    if (const int full = weights_[std::size_t(i)].full; full >= 0) full_.remove(full);
    this->remove_block(i);
    this->remove_from(weights_, i);
  }

  double cost(int begin, int end) const override {
    double total = 0;
    for (int i = begin; i < end; ++i) total += block_cost(i);
    return total;
  }
  double block_cost(int i) const override { return 0.5 * loss_at_point(std::size_t(i)).rho; }
  double weight(int i) const override { return loss_at_point(std::size_t(i)).d1; }
  std::optional<double> convex_widening() const override {
    std::optional<double> largest;
    Row r;
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const Loss& own = weights_[i].loss;
      if (own.kind == Loss::Kind::none) continue;
      this->value(i, r);
      whiten<1>(i, r.data());
      const double norm = std::sqrt(squared_norm<kDim>(r.data()));
      largest = std::max(largest.value_or(0.0), norm / (own.scale * std::sqrt(own.convex_until())));
    }
    return largest;
  }

  double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const override {
    double total = 0;
    Row r;
    Jacobians J;
    Pool::set_zero(J);  // GCC 12 does not see that linearize sets it
    typename Pool::Transposed transposed;
    for (std::size_t i = std::size_t(begin); i < std::size_t(end); ++i) {
      const int* offset = &place.offset[i * kArity];
      this->linearize(i, offset, r, J);
      whiten<1>(i, r.data());
      const Loss::Value value = loss_of(i, squared_norm<kDim>(r.data()));
      total += 0.5 * value.rho;
      static_for<kArity>([&]<int A>() {
        if (offset[A] < 0) return;
        constexpr int dof = Pool::kDofs[A];
        double *Ja = std::get<A>(J).data(), *JaT = std::get<A>(transposed).data();
        whiten<dof>(i, Ja);
        transpose<kDim, dof>(value.d1, Ja, JaT);
        add_multiplied<dof, kDim>(JaT, r.data(), gradient + offset[A]);
      });
      if (H) this->add_products(offset, &place.hessian[i * kPairs], transposed, J, H);
    }
    return total;
  }

  void add_stiffness(const PoolPlacement& place, const double* v, const double*, double& along,
                     double& scale) const override {
    Row r;
    Jacobians J;
    Pool::set_zero(J);
    for (std::size_t i = 0; i < this->residuals_.size(); ++i) {
      const int* offset = &place.offset[i * kArity];
      this->linearize(i, offset, r, J);
      whiten<1>(i, r.data());
      const double weight = loss_of(i, squared_norm<kDim>(r.data())).d1;
      const auto data = Pool::data(J);
      const Weight& w = weights_[i];
      for (int s = 0; s < kArity; ++s)
        detail::whiten(kDim, Pool::kDofs[std::size_t(s)], w.diagonal.data(),
                       w.full < 0 ? nullptr : full_.at(w.full).data(), data[std::size_t(s)]);
      add_block_stiffness({kDim, kArity, Pool::kDofs.data(), offset}, data.data(), v, weight, along, scale);
    }
  }

  void add_exact_hessian(const PoolPlacement& place, int begin, int end, double factor, const double*, double* gradient,
                         double* H) const override {
    Row r;
    Jacobians J;
    Pool::set_zero(J);
    for (std::size_t i = std::size_t(begin); i < std::size_t(end); ++i) {
      const auto dual = [&](const Row& at_point, Row& w) {  // factor ρ' Wᵀ W r
        std::copy_n(at_point.data(), kDim, w.data());
        whiten<1>(i, w.data());
        const double d1 = factor * loss_of(i, squared_norm<kDim>(w.data())).d1;
        unwhiten(i, w.data());
        for (int k = 0; k < kDim; ++k) w.data()[k] *= d1;
      };
      const int* offset = &place.offset[i * kArity];
      const HessianPlace* at = &place.hessian[i * kPairs];
      this->add_second_derivatives(i, offset, at, dual, r, J, gradient, H);
      if constexpr (Pool::kCurvature) {
        this->through_charts(i, offset, J);
        add_first_order(i, offset, at, factor, r, J, H);
      }
    }
  }

 private:
  struct Weight {
    std::array<double, kDim> diagonal;  // 1/σ
    int full;                           // index of W in full_, −1 when it is diagonal
    Loss loss;
  };

  /// Adds factor (ρ' Jᵀ J + 2ρ'' Jᵀ r rᵀ J), r and J whitened: the curvature that is not the residual's own.
  void add_first_order(std::size_t i, const int* offset, const HessianPlace* place, double factor, Row& r, Jacobians& J,
                       double* H) const {
    whiten<1>(i, r.data());
    const Loss::Value value = loss_of(i, squared_norm<kDim>(r.data()));
    typename Pool::Transposed transposed;
    static_for<kArity>([&]<int A>() {
      if (offset[A] < 0) return;
      constexpr int dof = Pool::kDofs[A];
      double *Ja = std::get<A>(J).data(), *JaT = std::get<A>(transposed).data();
      whiten<dof>(i, Ja);
      double g[dof];
      multiply_transposed<kDim, dof>(Ja, r.data(), g);
      transpose<kDim, dof>(factor * value.d1, Ja, JaT);
      for (int k = 0; k < kDim; ++k)
        for (int j = 0; j < dof; ++j) JaT[k * dof + j] += 2 * factor * value.d2 * g[j] * r.data()[k];
    });
    this->add_products(offset, place, transposed, J, H);
  }

  /// ρ, ρ', ρ'' at s = ‖r‖² of a whitened residual.
  Loss::Value loss_of(std::size_t i, double s) const {
    const Loss& own = weights_[i].loss;
    return Loss{own.kind, this->widening * own.scale}(s);
  }
  Loss::Value loss_at_point(std::size_t i) const {
    Row r;
    this->value(i, r);
    whiten<1>(i, r.data());
    return loss_of(i, squared_norm<kDim>(r.data()));
  }
  template <int columns>
  void whiten(std::size_t i, double* A) const {  // A ← W A
    const Weight& w = weights_[i];
    if (w.full < 0)
      scale_rows<kDim, columns>(w.diagonal.data(), A);
    else
      multiply_left<kDim, columns>(full_.at(w.full).data(), A);
  }
  void unwhiten(std::size_t i, double* r) const {  // r ← Wᵀ r
    const Weight& w = weights_[i];
    if (w.full < 0) return scale_rows<kDim, 1>(w.diagonal.data(), r);
    double product[kDim];
    multiply_transposed<kDim, kDim>(full_.at(w.full).data(), r, product);
    std::copy_n(product, kDim, r);
  }

  std::vector<Weight> weights_;
  SlotVector<std::array<double, std::size_t(kDim* kDim)>> full_;
};

}  // namespace tandem::detail
