#pragma once

#include <Eigen/Core>

#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/lanes.hpp>

namespace tandem::detail {

/// The curvature that a Gauss-Newton Hessian B leaves out, learned from past steps: limited-memory BFGS with B, fresh
/// at every iterate, in the place of the usual multiple of the identity (Nocedal & Wright 2006, alg. 7.4). Where
/// residuals stay large or a chain hangs free, plain Gauss-Newton creeps at a linear rate; with a few pairs it does not.
/// Steps and gradients of different charts are compared as they are: the frames differ by the order of the step.
///
/// Where B has a term of its own that changes from one iterate to the next, such as an augmented Lagrangian's penalty,
/// add() is given the gradients without that term, and refresh() its present Hessian.
///
/// Pairs are kept with single precision, rounded once and for all: what is learned is no better than that, and of a long
/// chain they are the most that a solve remembers.
class SecantPairs {
 public:
  SecantPairs(const LaneParts& parts, Eigen::Index unknowns, int capacity, bool with_term = false);

  void clear() { count_ = 0; }

  /// Step and change of the gradient along it; left out when they show no positive curvature.
  void add(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_before, const Eigen::VectorXd& gradient_after);

  /// add_product(s, y) adds the term's Hessian times s to y.
  void refresh(FunctionRef<void(const Eigen::VectorXd& s, Eigen::VectorXd& y)> add_product);

  /// d = H d, where solve(d) applies the inverse of B. The two loops over the pairs, whose products of vectors are made from
  /// Sᵀd, Yᵀd and SᵀY: four passes through the pairs.
  void apply(Eigen::VectorXd& d, FunctionRef<void(Eigen::VectorXd& d)> solve);

 private:
  Eigen::Index capacity() const { return rho_.size(); }
  Eigen::Index oldest() const { return count_ > capacity() ? count_ - capacity() : 0; }
  void find_curvature(Eigen::Index k, const Eigen::MatrixXf& y);
  void multiply_transposed(const Eigen::MatrixXf& A, const Eigen::VectorXd& d);
  void add_multiplied(const Eigen::MatrixXf& A, Eigen::VectorXd& d) const;

  LaneParts parts_;
  bool with_term_;
  Eigen::MatrixXf s_, y_, total_;
  Eigen::MatrixXd sy_;  // sᵢᵀ yⱼ of pairs i not newer than j
  Eigen::VectorXd rho_, alpha_, weight_;
  Eigen::VectorXd product_;          // of each pair, and two more
  Eigen::MatrixXd products_;         // the same of each part
  Eigen::VectorXd wide_s_, wide_y_;  // of refresh()
  Eigen::Index count_ = 0;
};

}  // namespace tandem::detail
