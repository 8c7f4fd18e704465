#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include <tandem/lie/error.hpp>
#include <tandem/problem/weighted_pool.hpp>

namespace tandem::detail {

/// A Gaussian prior on any number of variables, ½‖A (X ⊖ X̄) + b‖² + c, as Problem::marginalize leaves it: at most one
/// block, with as many states as it needs. (X ⊖ X̄) = Log(X̄⁻¹ X) for each variable, one after the other; the derivative
/// is exact at any distance, A blkdiag(Jr⁻¹). X̄ are the anchors in the variables' stores, so that a variable is in one
/// such prior at a time. White as it is: no noise, no loss.
class MarginalPrior final : public SoftPoolBase {
 public:
  struct State {
    StateStoreBase* store;
    int slot, id, dof;
  };

  /// In the place of the block that was there; X̄ are the variables' values. A has a column for each entry of their
  /// tangents.
  void set(std::vector<State> states, Eigen::MatrixXd A, Eigen::VectorXd b, double constant);
  const Eigen::MatrixXd& A() const { return A_; }
  const Eigen::VectorXd& b() const { return b_; }

  std::string_view name() const override { return "marginal prior"; }
  int dim() const override { return static_cast<int>(b_.size()); }
  int arity() const override { return static_cast<int>(states_.size()); }
  int size() const override { return there_ ? 1 : 0; }
  const int* variables(int) const override { return ids_.data(); }
  const int* dofs() const override { return dofs_.data(); }
  void remove(int) override;
  std::unique_ptr<SoftPoolBase> new_empty(const StoreInstead&) const override {
    return std::make_unique<MarginalPrior>();
  }
  void add_copy(const PoolBase&, int, const int*) override {
    throw Error("a marginal prior belongs to the problem that was marginalized: no part of one has it");
  }
  const void* residual(int) const override { return this; }
  void add_residual(const void*, const int*) override { throw Error("a marginal prior takes no residuals"); }
  /// The same over the stores of a copy of the problem, anchors included: places there are the same.
  std::unique_ptr<SoftPoolBase> copy(const StoreInstead& instead) const;
  const std::vector<State>& states() const { return states_; }
  double constant() const { return constant_; }
  void evaluate_block(int i, double* r) const override;
  void linearize_block(int i, const int* offset, double* r, double* J) const override;
  Gaussian noise(int) const override { return Gaussian(Eigen::VectorXd::Ones(b_.size())); }
  void set_noise(int, const Gaussian&) override { throw Error("set_noise: a marginal prior has none of its own"); }
  Loss loss(int) const override { return {}; }
  void set_loss(int, const Loss&) override { throw Error("set_loss: a marginal prior has none"); }
  void add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                     double& scale) const override;
  void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                         const double* multipliers, double* gradient, double* H) const override;
  double cost(const PoolPlacement&, int begin, int end) const override { return begin < end ? block_cost(begin) : 0.0; }
  double block_cost(int i) const override;
  double accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const override;
  double weight(int) const override { return 1.0; }
  std::optional<double> convex_widening() const override { return {}; }

 private:
  using Jacobian = Eigen::Map<Eigen::MatrixXd>;
  Jacobian jacobian(std::size_t s) const { return {J_.data() + first_jacobian_[s], states_[s].dof, states_[s].dof}; }
  double residual(const int* offset) const;
  void add_products(const PoolPlacement& place, double factor, double* H) const;

  bool there_ = false;
  std::vector<State> states_;
  std::vector<int> ids_, dofs_, first_, first_jacobian_;  // of each state: …, first column of A, first entry in J_
  Eigen::MatrixXd A_, information_;                       // AᵀA
  Eigen::VectorXd b_;
  double constant_ = 0;
  mutable Eigen::VectorXd x_, r_, g_, J_;  // of the last evaluation: X ⊖ X̄, A x + b, Aᵀ r, Jacobians of x
  mutable Eigen::VectorXd scratch_;
};

}  // namespace tandem::detail
