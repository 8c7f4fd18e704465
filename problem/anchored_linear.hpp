#pragma once

#include <vector>

#include <Eigen/Core>

#include <tandem/problem/pool.hpp>

namespace tandem::detail {

/// A variable that an AnchoredLinear reads.
struct AnchoredState {
  StateStoreBase* store;
  int slot, id, dof;
};

/// The function A (X ⊖ X̄) + b of any number of variables, created by Problem::marginalize(). X ⊖ X̄ stacks
/// Log(X̄⁻¹ X) of each variable. Its Jacobian A blkdiag(Jr⁻¹) is exact at any distance from X̄. X̄ are the anchors in
/// the state stores. A variable has one anchor, so all such functions of a problem are set together.
class AnchoredLinear {
 public:
  /// Sets or replaces the function. X̄ becomes the current values. A has one column per tangent entry of the states.
  void set(std::vector<AnchoredState> states, Eigen::MatrixXd A, Eigen::VectorXd b);
  /// Removes the function; size() is then 0.
  void clear();
  /// Replaces the stores by those of a copied problem, in which all slots and anchors are the same.
  void use_stores(const StoreMapping& mapping);

  int size() const { return has_block_ ? 1 : 0; }
  int rows() const { return static_cast<int>(b_.size()); }
  const Eigen::MatrixXd& A() const { return A_; }
  const Eigen::VectorXd& b() const { return b_; }
  const std::vector<AnchoredState>& states() const { return states_; }
  const std::vector<int>& ids() const { return ids_; }
  const std::vector<int>& dofs() const { return dofs_; }
  /// Returns the first column of A of each state.
  const std::vector<int>& first() const { return first_; }

  /// Computes the rows at the point. If `offset` is given, also computes the Jacobians of X ⊖ X̄ of the free states.
  const Eigen::VectorXd& evaluate(const int* offset) const;
  using Jacobian = Eigen::Map<Eigen::MatrixXd>;
  /// Returns the Jacobian of X ⊖ X̄ of state s, as last evaluated.
  Jacobian jacobian(std::size_t s) const { return {J_.data() + first_jacobian_[s], states_[s].dof, states_[s].dof}; }
  /// As PoolBase::linearize_block().
  void linearize(const int* offset, double* r, double* J) const;
  /// Adds the Hessian of factor · wᵀ r, where dual(r, w) computes w from the rows, by central differences of its
  /// gradient.
  void add_second_derivatives(const PoolPlacement& place, double factor,
                              FunctionRef<void(const Eigen::VectorXd& r, Eigen::VectorXd& w)> dual, double* H) const;

 private:
  bool has_block_ = false;
  std::vector<AnchoredState> states_;
  std::vector<int> ids_, dofs_, first_, first_jacobian_;  // of each state; first_jacobian_: entry of J_
  Eigen::MatrixXd A_;
  Eigen::VectorXd b_;
  mutable Eigen::VectorXd x_, r_, J_;  // last evaluation: X ⊖ X̄, A x + b, Jacobians of x
  mutable Eigen::VectorXd w_, g_, column_;
};

}  // namespace tandem::detail
