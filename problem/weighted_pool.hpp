#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <tandem/problem/pool.hpp>
#include <tandem/problem/slots.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem::detail {

class HardPoolBase;

/// Cost blocks ½ Σ ρ(‖W r‖²) of one residual type.
class SoftPoolBase : public PoolBase {
 public:
  /// Returns an empty pool of the same residual type and loss_scale over other stores.
  virtual std::unique_ptr<SoftPoolBase> new_empty(const StoreMapping& mapping) const = 0;
  /// Returns the cost of blocks begin … end − 1 in the order of evaluation.
  virtual double cost(const PoolPlacement& place, int begin, int end) const = 0;
  /// Returns the cost of block i.
  virtual double block_cost(int i) const = 0;
  /// Returns the cost like cost(). Adds the gradient and, if H is not null, the Gauss-Newton Hessian ρ' Jᵀ WᵀW J.
  virtual double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const = 0;
  /// Returns the weight ρ'(s) of block i.
  virtual double weight(int i) const = 0;
  virtual Gaussian noise(int i) const = 0;
  virtual void set_noise(int i, const Gaussian& noise) = 0;
  virtual Loss loss(int i) const = 0;  ///< as given, without loss_scale
  virtual void set_loss(int i, const Loss& loss) = 0;
  /// Returns the bounded rows as a hard pool if all blocks are SoftBound blocks without a loss and with independent
  /// noise. Otherwise returns null.
  virtual std::unique_ptr<HardPoolBase> bounded_rows() const { return {}; }
  /// Returns the smallest loss_scale for which all losses are convex at the point; empty if no loss is robust.
  virtual std::optional<double> convex_loss_scale() const = 0;

  double loss_scale = 1.0;  ///< factor on the scales of all losses
};

/// Stores the noises and losses of cost blocks, and implements all that need not be compiled for each residual type.
class WeightedPool : public SoftPoolBase {
 public:
  /// Exact noise and loss of a block, unlike noise(), which may round.
  struct Weight {
    const double* diagonal;  ///< 1/σ of each row
    const double* full;      ///< W, column-major, or null if it is diagonal
    Loss loss;
  };
  Weight raw_weight(int i) const {
    return {diagonal_.data() + std::ptrdiff_t(i) * dim(), full(std::size_t(i)), losses_[std::size_t(i)]};
  }
  /// Appends noise and loss of the block that was added last.
  void add_raw_weight(const Weight& weight);
  void remove(int i) final;
  void add_copy(const PoolBase& from, int i, const int* slots) final;
  double block_cost(int i) const final { return 0.5 * loss_at_point(i).rho; }
  double weight(int i) const final { return loss_at_point(i).d1; }
  Gaussian noise(int i) const final;
  void set_noise(int i, const Gaussian& noise) final;
  Loss loss(int i) const final { return losses_[std::size_t(i)]; }
  void set_loss(int i, const Loss& loss) final { losses_[std::size_t(i)] = loss; }
  std::optional<double> convex_loss_scale() const final;
  void add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                     double& scale) const final;

 protected:
  /// Removes the residual of block i.
  virtual void remove_residual(int i) = 0;
  /// Appends noise and loss of the block that was added last.
  void add_weight(const Gaussian& noise, const Loss& loss);
  /// Returns whether no block has a loss or correlated noise.
  bool is_plain() const;
  /// Returns 1/σ of each row of block i.
  const double* diagonal(std::size_t i) const { return diagonal_.data() + i * std::size_t(dim()); }
  /// Returns the whitening matrix W of block i, or null if it is diagonal.
  const double* full(std::size_t i) const { return full_[i] < 0 ? nullptr : matrices_.at(full_[i]).data(); }
  /// Returns ρ, ρ', ρ'' at s = ‖r‖² of a whitened residual.
  Loss::Value loss_of(std::size_t i, double s) const { return scaled_loss(i)(s); }
  Loss scaled_loss(std::size_t i) const { return {losses_[i].kind, loss_scale * losses_[i].scale}; }

 private:
  Loss::Value loss_at_point(int i) const;
  double squared_norm_at_point(int i) const;  // ‖W r‖² at the point

  std::vector<double> diagonal_;  // dim() entries per block
  std::vector<int> full_;         // per block: index in matrices_, −1 if W is diagonal
  SlotVector<std::vector<double>> matrices_;
  std::vector<Loss> losses_;
  mutable Eigen::VectorXd r_, J_;  // scratch of add_stiffness()
};

}  // namespace tandem::detail
