#pragma once

#include <memory>
#include <numeric>
#include <span>

#include <tandem/problem/block_pool.hpp>
#include <tandem/problem/weighted_pool.hpp>

namespace tandem::detail {

/// Cost blocks of one residual type: the functions that run in the loops of solvers.
class SoftPool final : public BlockPool<WeightedPool> {
 public:
  SoftPool(const ResidualFunctions& functions, std::span<StateStoreBase* const> stores)
      : BlockPool(functions, stores) {}

  void add(const void* residual, const int* slots, const Gaussian& noise, const Loss& loss) {
    add_residual(residual, slots);
    add_weight(noise, loss);
  }
  std::unique_ptr<SoftPoolBase> new_empty(const StoreMapping& mapping) const override;
  std::unique_ptr<HardPoolBase> bounded_rows() const override;
  /// Returns the number of evaluations of single blocks for the finite differences of add_exact_hessian().
  long long num_curvature_evaluations() const {
    const ResidualFunctions& f = blocks_.functions();
    return f.linear || f.curvature ? 0 : 2LL * size() * std::accumulate(f.dofs, f.dofs + f.arity, 0);
  }
  double cost(const PoolPlacement& place, int begin, int end) const override;
  double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const override;
  void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                         const double* multipliers, double* gradient, double* H) const override;

 private:
  using Reader = ResidualBlocks::Reader;

  BlockWeight weight_of(std::size_t i) const { return {diagonal(i), full(i), scaled_loss(i)}; }
  double add(const PoolPlacement& place, std::size_t i, double* r, double* const* J, double* transposed,
             double* gradient, double* H) const;
  void accumulate_batch(Reader& at, const PoolPlacement& place, int k, int end, double& total, double* gradient,
                        double* H) const;
  void add_exact_hessian_of_batch(Reader& at, const PoolPlacement& place, int k, int end, Curvature wanted,
                                  double factor, double* gradient, double* H) const;
  void add_exact_hessian_of_block(Reader& at, const PoolPlacement& place, std::size_t i, Curvature wanted,
                                  double factor, double* gradient, double* H) const;
  void add_first_order(const PoolPlacement& place, std::size_t i, const BlockWeight& weight, double gauss_newton_factor,
                       double loss_factor, const LinearizedBlock& block, double* H) const;

  BlockShape shape(const PoolPlacement& place, std::size_t i) const {
    return blocks_.shape(&place.offset[i * std::size_t(arity())]);
  }
  const HessianPlace* hessian(const PoolPlacement& place, std::size_t i) const {
    return &place.hessian[i * std::size_t(arity() * (arity() + 1) / 2)];
  }
};

}  // namespace tandem::detail
