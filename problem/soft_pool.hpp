#pragma once

#include <memory>

#include <tandem/problem/hard_pool.hpp>
#include <tandem/problem/weighted_pool.hpp>
#include <tandem/residuals/soft_bound.hpp>

namespace tandem::detail {

/// Cost blocks of one residual type: the functions that run in the loops of solvers.
template <Residual R>
class SoftPool final : public BlockPool<R, WeightedPool> {
  using Pool = BlockPool<R, WeightedPool>;
  using Pool::kArity, Pool::kDim, Pool::kPairs;
  using typename Pool::Jacobians, typename Pool::Row;

 public:
  explicit SoftPool(const typename Pool::Stores& stores) : Pool(stores) {}

  void add(const R& residual, const std::array<int, kArity>& slots, const Gaussian& noise, const Loss& loss) {
    this->add_block(residual, slots);
    this->add_weight(noise, loss);
  }
  std::unique_ptr<SoftPoolBase> new_empty(const StoreMapping& mapping) const override {
    auto pool = std::make_unique<SoftPool>(this->stores_of(mapping));
    pool->loss_scale = this->loss_scale;
    return pool;
  }

  std::unique_ptr<HardPoolBase> bounded_rows() const override {
    if constexpr (is_soft_bound<R>) {
      if (!this->is_plain()) return {};
      auto rows = std::make_unique<HardPool<decltype(R::residual)>>(this->stores_);
      for (const auto& block : this->blocks_) rows->add(block.residual.residual, block.slots, block.residual.bounds);
      return rows;
    }
    return {};
  }

  double cost(const PoolPlacement& place, int begin, int end) const override {
    double total = 0;
    int k = begin;
    if constexpr (Batched<R>::exists)
      for (; end - k > 1 && this->batches(); k += kBatch) {
        double r[kBatch * kDim];
        const auto blocks = this->batch(place, k, end);
        this->evaluate_batch(blocks, r);
        for (int b = 0; b < std::min(kBatch, end - k); ++b)
          total += soft_block_cost<kDim>(weight_of(blocks[std::size_t(b)]), r + b * kDim);
      }
    Row r;
    for (; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      this->value(i, r);
      total += soft_block_cost<kDim>(weight_of(i), r.data());
    }
    return total;
  }
  double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const override {
    double total = 0;
    int k = begin;
    if constexpr (Batched<R>::exists)
      for (; end - k > 1 && this->batches(); k += kBatch) accumulate_batch(place, k, end, total, gradient, H);
    Row r;
    Jacobians J;
    Pool::set_zero(J);  // avoids a false warning of GCC 12
    const auto columns = Pool::data(J);
    for (; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      this->linearize(i, &place.offset[i * kArity], r, J);
      total += add(place, i, r.data(), columns.data(), gradient, H);
    }
    return total;
  }

  void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor, const double*,
                         double* gradient, double* H) const override {
    int k = begin;
    if constexpr (Batched<R>::exists)
      for (; end - k > 1 && this->batches(); k += kBatch)
        add_exact_hessian_of_batch(place, k, end, wanted, factor, gradient, H);
    Row r;
    Jacobians J;
    Pool::set_zero(J);
    for (; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      const BlockWeight weight = weight_of(i);
      const auto dual = [&](const Row& at_point, Row& w) {
        soft_block_dual(kDim, weight, factor, at_point.data(), w.data());
      };
      const int* offset = &place.offset[i * kArity];
      const HessianPlace* at = &place.hessian[i * kPairs];
      double gauss_newton_factor = wanted == Curvature::all ? factor : 0.0, loss_factor = factor;
      const bool first_order = gauss_newton_factor != 0 || weight.loss.kind != Loss::Kind::none;
      if constexpr (IsLinear<R>) {
        if (!first_order) continue;
        this->linearize(i, offset, r, J);
      } else {
        this->add_second_derivatives(i, offset, at, dual, r, J, gradient, H);
        if constexpr (Pool::kCurvature) {
          if (!first_order) continue;
          this->apply_charts(i, offset, J);
        } else {  // differences include all terms
          if (wanted == Curvature::all) continue;
          this->linearize(i, offset, r, J);
          gauss_newton_factor = -factor;
          loss_factor = 0.0;
        }
      }
      const auto columns = Pool::data(J);
      add_first_order(place, i, weight, gauss_newton_factor, loss_factor, r.data(), columns.data(), H);
    }
  }

 private:
  BlockWeight weight_of(std::size_t i) const {
    return {this->template diagonal<kDim>(i), this->full(i), this->scaled_loss(i)};
  }
  double add(const PoolPlacement& place, std::size_t i, double* r, double* const* J, double* gradient,
             double* H) const {
    typename Pool::Transposed transposed;
    return add_soft_block<kDim>(Pool::shape(&place.offset[i * kArity]), &place.hessian[i * kPairs], weight_of(i),
                                {r, J, transposed.data()}, gradient, H);
  }
  /// Accumulates one batch: blocks k … end − 1 in the order of evaluation, at most kBatch. Adds their costs to `total`
  /// one by one, like cost(), for a bitwise equal sum.
  void accumulate_batch(const PoolPlacement& place, int k, int end, double& total, double* gradient, double* H) const {
    const auto blocks = this->batch(place, k, end);
    double r[kBatch * kDim], J[kBatch * kDim * Pool::kSumOfDofs];
    this->linearize_batch(blocks, r, J);
    for (int b = 0; b < std::min(kBatch, end - k); ++b) {
      const std::size_t i = blocks[std::size_t(b)];
      const auto columns = Pool::of_batch(J, b);
      detail::apply_charts<kDim>(Pool::shape(&place.offset[i * kArity]), this->charts(i).data(), columns.data());
      total += add(place, i, r + b * kDim, columns.data(), gradient, H);
    }
  }
  /// Adds the exact Hessian of one batch.
  void add_exact_hessian_of_batch(const PoolPlacement& place, int k, int end, Curvature wanted, double factor,
                                  double* gradient, double* H) const {
    constexpr int n = Pool::kSumOfDofs;
    const auto blocks = this->batch(place, k, end);
    double r[kBatch * kDim], w[kBatch * kDim], J[kBatch * kDim * n], C[kBatch * n * n];
    this->linearize_batch(blocks, r, J);
    for (int b = 0; b < kBatch; ++b)
      soft_block_dual(kDim, weight_of(blocks[std::size_t(b)]), factor, r + b * kDim, w + b * kDim);
    this->curvature_batch(blocks, w, C);
    const double gauss_newton_factor = wanted == Curvature::all ? factor : 0.0;
    for (int b = 0; b < std::min(kBatch, end - k); ++b) {
      const std::size_t i = blocks[std::size_t(b)];
      const BlockWeight weight = weight_of(i);
      const BlockShape shape = Pool::shape(&place.offset[i * kArity]);
      const auto columns = Pool::of_batch(J, b);
      const auto charts = this->charts(i);
      add_block_curvature(shape, &place.hessian[i * kPairs], columns.data(), charts.data(), w + b * kDim, C + b * n * n,
                          gradient, H);
      if (gauss_newton_factor == 0 && weight.loss.kind == Loss::Kind::none) continue;
      detail::apply_charts<kDim>(shape, charts.data(), columns.data());
      add_first_order(place, i, weight, gauss_newton_factor, factor, r + b * kDim, columns.data(), H);
    }
  }
  void add_first_order(const PoolPlacement& place, std::size_t i, const BlockWeight& weight, double gauss_newton_factor,
                       double loss_factor, double* r, double* const* J, double* H) const {
    typename Pool::Transposed transposed;
    detail::add_first_order<kDim>(Pool::shape(&place.offset[i * kArity]), &place.hessian[i * kPairs], weight,
                                  {r, J, transposed.data()}, gauss_newton_factor, loss_factor, H);
  }
};

}  // namespace tandem::detail
