#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include <tandem/lie/error.hpp>
#include <tandem/problem/anchored_linear.hpp>
#include <tandem/problem/weighted_pool.hpp>

namespace tandem::detail {

/// Gaussian prior ½‖A (X ⊖ X̄) + b‖² + c on any number of variables, created by Problem::marginalize(). The pool has at
/// most one block, already white and without a loss.
class MarginalPrior final : public SoftPoolBase {
 public:
  /// Sets or replaces the block. X̄ becomes the current values. A has one column per tangent entry of the states.
  void set(std::vector<AnchoredState> states, Eigen::MatrixXd A, Eigen::VectorXd b, double constant);
  const AnchoredLinear& linear() const { return linear_; }

  std::string_view name() const override { return "marginal prior"; }
  int dim() const override { return linear_.rows(); }
  int arity() const override { return static_cast<int>(linear_.states().size()); }
  int size() const override { return linear_.size(); }
  const int* variables(int) const override { return linear_.ids().data(); }
  const int* dofs() const override { return linear_.dofs().data(); }
  void remove(int) override { linear_.clear(); }
  std::unique_ptr<SoftPoolBase> new_empty(const StoreMapping&) const override {
    return std::make_unique<MarginalPrior>();
  }
  void add_copy(const PoolBase&, int, const int*) override {
    throw BadInputError("the marginal prior cannot be part of a Subproblem; choose variables that it does not read");
  }
  const void* residual(int) const override { return this; }
  void add_residual(const void*, const int*) override {
    throw BadInputError("residuals cannot be added to a marginal prior");
  }
  void points(int, const void**) const override {
    throw BadInputError("the points of a marginal prior are not available");
  }
  void set_residual(int, const void*) override {
    throw BadInputError("set_residual: a marginal prior cannot be replaced");
  }
  /// Returns a copy over the stores of a copied problem, in which all slots and anchors are the same.
  std::unique_ptr<SoftPoolBase> copy(const StoreMapping& mapping) const;
  double constant() const { return constant_; }
  void evaluate_block(int i, double* r) const override;
  void linearize_block(int, const int* offset, double* r, double* J) const override { linear_.linearize(offset, r, J); }
  Gaussian noise(int) const override { return Gaussian(Eigen::VectorXd::Ones(dim())); }
  void set_noise(int, const Gaussian&) override {
    throw BadInputError("set_noise: the noise of a marginal prior is fixed");
  }
  Loss loss(int) const override { return {}; }
  void set_loss(int, const Loss&) override { throw BadInputError("set_loss: a marginal prior cannot have a loss"); }
  void add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                     double& scale) const override;
  void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                         const double* multipliers, double* gradient, double* H) const override;
  double cost(const PoolPlacement&, int begin, int end) const override { return begin < end ? block_cost(begin) : 0.0; }
  double block_cost(int i) const override;
  double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const override;
  double weight(int) const override { return 1.0; }
  std::optional<double> convex_loss_scale() const override { return {}; }

 private:
  double cost_of(const Eigen::VectorXd& r) const { return 0.5 * r.squaredNorm() + constant_; }
  void add_products(const PoolPlacement& place, double factor, double* H) const;

  AnchoredLinear linear_;
  Eigen::MatrixXd information_;  // AᵀA
  double constant_ = 0;
  mutable Eigen::VectorXd r_, g_, scratch_;  // A J v or Aᵀ r, and blocks
};

}  // namespace tandem::detail
