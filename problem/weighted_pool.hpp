#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <tandem/problem/pool.hpp>
#include <tandem/problem/slots.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem::detail {

class HardPoolBase;

/// Blocks that are costs: ½ Σ ρ(‖W r‖²).
class SoftPoolBase : public PoolBase {
 public:
  /// An empty pool of the same residual and widening, over other stores.
  virtual std::unique_ptr<SoftPoolBase> new_empty(const StoreInstead& instead) const = 0;
  /// Cost at the point of the begin-th to the last before the end-th block in the placement's order.
  virtual double cost(const PoolPlacement& place, int begin, int end) const = 0;
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
  /// The rows whose distance outside their bounds the blocks are, as those of a hard pool: of Outside without a loss, rows
  /// of independent noise. Null where a block is something else.
  virtual std::unique_ptr<HardPoolBase> bounded_rows() const { return {}; }
  /// The least factor on the scales of the losses with which all are convex at the point; empty when none is robust.
  virtual std::optional<double> convex_widening() const = 0;

  double widening = 1.0;  ///< factor on the scale of every loss
};

/// The blocks' noises and losses, and all of their costs that is not worth compiling for each residual.
class WeightedPool : public SoftPoolBase {
 public:
  /// A block's W, 1/σ of each row or, where `full` is not null, by columns, and its loss, to the last bit: noise() may round.
  struct Weight {
    const double *diagonal, *full;
    Loss loss;
  };
  Weight weight_as_it_is(int i) const {
    return {diagonal_.data() + std::ptrdiff_t(i) * dim(), full(std::size_t(i)), losses_[std::size_t(i)]};
  }
  /// Of the block that was added last.
  void add_weight_as_it_is(const Weight& weight);
  void remove(int i) final;
  void add_copy(const PoolBase& from, int i, const int* slots) final;
  double block_cost(int i) const final { return 0.5 * loss_at_point(i).rho; }
  double weight(int i) const final { return loss_at_point(i).d1; }
  Gaussian noise(int i) const final;
  void set_noise(int i, const Gaussian& noise) final;
  Loss loss(int i) const final { return losses_[std::size_t(i)]; }
  void set_loss(int i, const Loss& loss) final { losses_[std::size_t(i)] = loss; }
  std::optional<double> convex_widening() const final;
  void add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                     double& scale) const final;

 protected:
  /// That of remove() which is the residual's.
  virtual void remove_residual(int i) = 0;
  /// Of the block that was added last.
  void add_weight(const Gaussian& noise, const Loss& loss);
  /// Whether no block has a loss or rows of noise that are not independent.
  bool is_plain() const;
  /// 1/σ of each row of block i, with the pool's dim() at compile time; or, where it is not null, its W by columns.
  template <int dim>
  const double* diagonal(std::size_t i) const {
    return diagonal_.data() + i * dim;
  }
  const double* full(std::size_t i) const { return full_[i] < 0 ? nullptr : matrices_.at(full_[i]).data(); }
  /// ρ, ρ', ρ'' at s = ‖r‖² of a whitened residual.
  Loss::Value loss_of(std::size_t i, double s) const { return widened_loss(i)(s); }
  Loss widened_loss(std::size_t i) const { return {losses_[i].kind, widening * losses_[i].scale}; }

 private:
  Loss::Value loss_at_point(int i) const;
  double squared_norm_at_point(int i) const;  // of W r

  std::vector<double> diagonal_;  // of each block dim() entries
  std::vector<int> full_;         // of each block, its place in matrices_, −1 where W is diagonal
  SlotVector<std::vector<double>> matrices_;
  std::vector<Loss> losses_;
  mutable Eigen::VectorXd r_, J_;  // of add_stiffness()
};

}  // namespace tandem::detail
