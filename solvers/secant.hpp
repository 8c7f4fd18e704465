#pragma once

#include <vector>

#include <Eigen/Core>

namespace tandem::detail {

/// The curvature that a Gauss-Newton Hessian B leaves out, learned from past steps: limited-memory BFGS with B, fresh
/// at every iterate, in the place of the usual multiple of the identity (Nocedal & Wright 2006, alg. 7.4). Where
/// residuals stay large or a chain hangs free, plain Gauss-Newton creeps at a linear rate; with a few pairs it does not.
/// Steps and gradients of different charts are compared as they are: the frames differ by the order of the step.
class SecantPairs {
 public:
  SecantPairs(Eigen::Index unknowns, int capacity)
      : s_(unknowns, capacity), y_(unknowns, capacity), rho_(capacity), weight_(capacity) {}

  void clear() { count_ = 0; }

  /// Step and change of the gradient along it; left out when they show no positive curvature.
  void add(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_before, const Eigen::VectorXd& gradient_after) {
    if (rho_.size() == 0) return;
    const Eigen::Index i = count_ % rho_.size();
    y_.col(i) = gradient_after - gradient_before;
    const double sy = step.dot(y_.col(i));
    if (!(sy > 1e-8 * step.norm() * y_.col(i).norm())) return;
    s_.col(i) = step;
    rho_[i] = 1.0 / sy;
    ++count_;
  }

  /// d = H d, where solve(d) applies the inverse of B.
  template <class Solve>
  void apply(Eigen::VectorXd& d, Solve solve) {
    const Eigen::Index capacity = rho_.size(), first = std::max<Eigen::Index>(0, count_ - capacity);
    for (Eigen::Index k = count_; k-- > first;) {
      const Eigen::Index i = k % capacity;
      weight_[i] = rho_[i] * s_.col(i).dot(d);
      d -= weight_[i] * y_.col(i);
    }
    solve(d);
    for (Eigen::Index k = first; k < count_; ++k) {
      const Eigen::Index i = k % capacity;
      d += (weight_[i] - rho_[i] * y_.col(i).dot(d)) * s_.col(i);
    }
  }

 private:
  Eigen::MatrixXd s_, y_;
  Eigen::VectorXd rho_, weight_;
  Eigen::Index count_ = 0;
};

}  // namespace tandem::detail
