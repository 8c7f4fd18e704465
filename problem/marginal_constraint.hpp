#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include <tandem/lie/error.hpp>
#include <tandem/problem/anchored_linear.hpp>
#include <tandem/problem/hard_pool.hpp>

namespace tandem::detail {

/// Hard constraint A (X ⊖ X̄) + b = 0 on any number of variables: the restriction of the remaining variables that hard
/// rows on marginalised variables imply. Created by Problem::marginalize(). The pool has at most one block.
class MarginalConstraint final : public HardPoolBase {
 public:
  /// Adds the block, in place of a removed one. X̄ becomes the current values. A has one column per tangent entry of
  /// the states.
  void set(std::vector<AnchoredState> states, Eigen::MatrixXd A, Eigen::VectorXd b);
  const AnchoredLinear& linear() const { return linear_; }

  std::string_view name() const override { return "marginal constraint"; }
  int dim() const override { return linear_.rows(); }
  int arity() const override { return static_cast<int>(linear_.states().size()); }
  int size() const override { return linear_.size(); }
  const int* variables(int) const override { return linear_.ids().data(); }
  const int* dofs() const override { return linear_.dofs().data(); }
  std::unique_ptr<HardPoolBase> new_empty(const StoreMapping&) const override {
    return std::make_unique<MarginalConstraint>();
  }
  const void* residual(int) const override { return this; }
  void add_residual(const void*, const int*) override {
    throw BadInputError(
        "the marginal constraint cannot be part of a Subproblem; choose variables that it does not read");
  }
  void points(int, const void**) const override {
    throw BadInputError("the points of a marginal constraint are not available");
  }
  void set_residual(int, const void*) override {
    throw BadInputError("set_residual: a marginal constraint cannot be replaced");
  }
  /// Returns a copy over the stores of a copied problem, in which all slots and anchors are the same.
  std::unique_ptr<HardPoolBase> copy(const StoreMapping& mapping) const;
  void evaluate_block(int, double* r) const override;
  void linearize_block(int, const int* offset, double* r, double* J) const override { linear_.linearize(offset, r, J); }
  void values(const PoolPlacement& place, int begin, int end, double* c) const override;
  void jacobian(const PoolPlacement& place, int begin, int end, double* c, double* values) const override;
  void accumulate(const PoolPlacement& place, int begin, int end, const double* weights, const double* jacobian,
                  double* H) const override;
  void add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                         const double* multipliers, double* gradient, double* H) const override;

 private:
  void remove_residual(int) override { linear_.clear(); }

  AnchoredLinear linear_;
};

}  // namespace tandem::detail
