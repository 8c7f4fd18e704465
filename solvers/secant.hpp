#pragma once

#include <Eigen/Core>

#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/parallel_tasks.hpp>

namespace tandem::detail {

/// Secant pairs that represent the curvature that a Gauss-Newton Hessian B neglects. They are used by limited-memory
/// BFGS with the present B in place of the usual multiple of the identity (Nocedal & Wright 2006, alg. 7.4).
///
/// Plain Gauss-Newton converges slowly if residuals stay large or the end of a chain is poorly observed; a few pairs
/// prevent this. Steps and gradients of different charts are combined without transport. The frames differ by the order
/// of the step.
///
/// B may contain a term that changes between iterates, such as the penalty of an augmented Lagrangian. Then add() needs
/// gradients without that term, and refresh() needs its present Hessian.
///
/// `Scalar` is the type of the stored pairs. Single precision is sufficient for costs, and halves the memory, which
/// dominates a solve of a long chain. Constraints of large weight need double precision, as a step hardly changes their
/// rows.
template <class Scalar>
class SecantPairs {
 public:
  SecantPairs(const ChunkedLoop& parts, Eigen::Index unknowns, int capacity, bool with_term = false);

  void clear() { count_ = 0; }

  /// Adds a step and the change of the gradient along it. Discards them if the curvature is not positive.
  void add(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_before, const Eigen::VectorXd& gradient_after);

  /// Updates the pairs. add_product(s, y) must add to y the product of the Hessian of the term with s.
  void refresh(FunctionRef<void(const Eigen::VectorXd& s, Eigen::VectorXd& y)> add_product);

  /// d = H d, where solve(d) applies the inverse of B.
  void apply(Eigen::VectorXd& d, FunctionRef<void(Eigen::VectorXd& d)> solve);

 private:
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  Eigen::Index capacity() const { return rho_.size(); }
  Eigen::Index oldest() const { return count_ > capacity() ? count_ - capacity() : 0; }
  /// Returns 1 / sᵀy of pair i, or 0 to skip the pair.
  double inverse_curvature(Eigen::Index i, const Matrix& y) const;
  /// Adds w times column a of A to d, then returns the product of column b of B with d, in one pass. A negative column
  /// index skips its part.
  double add_and_multiply(double w, const Matrix& A, Eigen::Index a, const Matrix& B, Eigen::Index b,
                          Eigen::VectorXd& d) const;

  ChunkedLoop parts_;
  bool with_term_;
  Matrix s_, y_, total_;
  Eigen::VectorXd rho_, weight_;
  Eigen::VectorXd wide_s_, wide_y_;  // memory of refresh()
  Eigen::Index count_ = 0;
};

extern template class SecantPairs<float>;
extern template class SecantPairs<double>;

}  // namespace tandem::detail
