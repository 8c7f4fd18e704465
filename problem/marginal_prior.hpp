#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include <tandem/lie/error.hpp>
#include <tandem/problem/weighted_pool.hpp>

namespace tandem::detail {

/// Gaussian prior ½‖A (X ⊖ X̄) + b‖² + c on any number of variables, created by Problem::marginalize(). X ⊖ X̄ stacks
/// Log(X̄⁻¹ X) of each variable. Its Jacobian A blkdiag(Jr⁻¹) is exact at any distance from X̄. X̄ are the anchors in
/// the state stores, so each variable can be in one such prior only. The pool has at most one block, already white and
/// without a loss.
class MarginalPrior final : public SoftPoolBase {
 public:
  struct State {
    StateStoreBase* store;
    int slot, id, dof;
  };

  /// Sets or replaces the block. X̄ becomes the current values. A has one column per tangent entry of the states.
  void set(std::vector<State> states, Eigen::MatrixXd A, Eigen::VectorXd b, double constant);
  const Eigen::MatrixXd& A() const { return A_; }
  const Eigen::VectorXd& b() const { return b_; }

  std::string_view name() const override { return "marginal prior"; }
  int dim() const override { return static_cast<int>(b_.size()); }
  int arity() const override { return static_cast<int>(states_.size()); }
  int size() const override { return has_block_ ? 1 : 0; }
  const int* variables(int) const override { return ids_.data(); }
  const int* dofs() const override { return dofs_.data(); }
  void remove(int) override;
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
  void set_residual(int, const void*) override {
    throw BadInputError("set_residual: a marginal prior cannot be replaced");
  }
  /// Returns a copy over the stores of a copied problem, in which all slots and anchors are the same.
  std::unique_ptr<SoftPoolBase> copy(const StoreMapping& mapping) const;
  const std::vector<State>& states() const { return states_; }
  double constant() const { return constant_; }
  void evaluate_block(int i, double* r) const override;
  void linearize_block(int i, const int* offset, double* r, double* J) const override;
  Gaussian noise(int) const override { return Gaussian(Eigen::VectorXd::Ones(b_.size())); }
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
  using Jacobian = Eigen::Map<Eigen::MatrixXd>;
  Jacobian jacobian(std::size_t s) const { return {J_.data() + first_jacobian_[s], states_[s].dof, states_[s].dof}; }
  double residual(const int* offset) const;
  void add_products(const PoolPlacement& place, double factor, double* H) const;

  bool has_block_ = false;
  std::vector<State> states_;
  std::vector<int> ids_, dofs_, first_,
      first_jacobian_;               // of each state; first_: column of A, first_jacobian_: entry of J_
  Eigen::MatrixXd A_, information_;  // AᵀA
  Eigen::VectorXd b_;
  double constant_ = 0;
  mutable Eigen::VectorXd x_, r_, g_, J_;  // last evaluation: X ⊖ X̄, A x + b, Aᵀ r, Jacobians of x
  mutable Eigen::VectorXd scratch_;
};

}  // namespace tandem::detail
