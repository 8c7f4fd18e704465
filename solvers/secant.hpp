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
/// Scalar: as what pairs are kept. Of a long chain they are the most that a solve remembers, and what they tell of a cost is
/// no better than single precision. Not so under constraints of large weight, which hardly curve along a step because
/// it keeps to them, and would along its rounding.
template <class Scalar>
class SecantPairs {
 public:
  SecantPairs(const LaneParts& parts, Eigen::Index unknowns, int capacity, bool with_term = false);

  void clear() { count_ = 0; }

  /// Step and change of the gradient along it; left out when they show no positive curvature.
  void add(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_before, const Eigen::VectorXd& gradient_after);

  /// add_product(s, y) adds the term's Hessian times s to y.
  void refresh(FunctionRef<void(const Eigen::VectorXd& s, Eigen::VectorXd& y)> add_product);

  /// d = H d, where solve(d) applies the inverse of B.
  void apply(Eigen::VectorXd& d, FunctionRef<void(Eigen::VectorXd& d)> solve);

 private:
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  Eigen::Index capacity() const { return rho_.size(); }
  Eigen::Index oldest() const { return count_ > capacity() ? count_ - capacity() : 0; }
  /// 1 / sᵀy of pair i, or 0, which leaves the pair out.
  double inverse_curvature(Eigen::Index i, const Matrix& y) const;
  /// d += w times A's column a, and then B's column b times d, in one pass; neither where it is negative.
  double add_and_multiply(double w, const Matrix& A, Eigen::Index a, const Matrix& B, Eigen::Index b,
                          Eigen::VectorXd& d) const;

  LaneParts parts_;
  bool with_term_;
  Matrix s_, y_, total_;
  Eigen::VectorXd rho_, weight_;
  Eigen::VectorXd wide_s_, wide_y_;  // of refresh()
  Eigen::Index count_ = 0;
};

extern template class SecantPairs<float>;
extern template class SecantPairs<double>;

}  // namespace tandem::detail
