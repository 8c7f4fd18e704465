#pragma once

#include <algorithm>

#include <Eigen/Core>

#include <tandem/problem/populate.hpp>

namespace tandem::detail {

/// The curvature that a Gauss-Newton Hessian B leaves out, learned from past steps: limited-memory BFGS with B, fresh
/// at every iterate, in the place of the usual multiple of the identity (Nocedal & Wright 2006, alg. 7.4). Where
/// residuals stay large or a chain hangs free, plain Gauss-Newton creeps at a linear rate; with a few pairs it does not.
/// Steps and gradients of different charts are compared as they are: the frames differ by the order of the step.
///
/// Where B has a term of its own that changes from one iterate to the next, such as an augmented Lagrangian's penalty,
/// add() is given the gradients without that term, and refresh() its present Hessian.
class SecantPairs {
 public:
  SecantPairs(Eigen::Index unknowns, int capacity, bool with_term = false)
      : with_term_(with_term),
        s_(unknowns, capacity),
        y_(unknowns, capacity),
        total_(unknowns, with_term ? capacity : 0),
        rho_(capacity),
        weight_(capacity) {}

  void clear() { count_ = 0; }

  /// Step and change of the gradient along it; left out when they show no positive curvature.
  void add(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_before, const Eigen::VectorXd& gradient_after) {
    if (rho_.size() == 0) return;
    const Eigen::Index i = count_ % rho_.size();
    if (count_ < rho_.size())
      for (Eigen::MatrixXd* pairs : {&s_, &y_})
        populate(pairs->col(i).data(), std::size_t(step.size()) * sizeof(double));
    s_.col(i) = step;
    y_.col(i) = gradient_after - gradient_before;
    rho_[i] = inverse_curvature(i, y_);
    if (rho_[i] > 0 || with_term_) ++count_;
  }

  /// add_product(s, y) adds the term's Hessian times s to y.
  template <class AddProduct>
  void refresh(AddProduct add_product) {
    for (Eigen::Index i = 0; i < std::min(count_, rho_.size()); ++i) {
      total_.col(i) = y_.col(i);
      add_product(s_.col(i), total_.col(i));
      rho_[i] = inverse_curvature(i, total_);
    }
  }

  /// d = H d, where solve(d) applies the inverse of B.
  template <class Solve>
  void apply(Eigen::VectorXd& d, Solve solve) {
    const Eigen::MatrixXd& y = with_term_ ? total_ : y_;
    const Eigen::Index capacity = rho_.size(), first = std::max<Eigen::Index>(0, count_ - capacity);
    for (Eigen::Index k = count_; k-- > first;) {
      const Eigen::Index i = k % capacity;
      if (rho_[i] == 0) continue;
      weight_[i] = rho_[i] * s_.col(i).dot(d);
      d -= weight_[i] * y.col(i);
    }
    solve(d);
    for (Eigen::Index k = first; k < count_; ++k) {
      const Eigen::Index i = k % capacity;
      if (rho_[i] == 0) continue;
      d += (weight_[i] - rho_[i] * y.col(i).dot(d)) * s_.col(i);
    }
  }

 private:
  /// 1 / sᵀy of pair i, or 0, which leaves the pair out.
  double inverse_curvature(Eigen::Index i, const Eigen::MatrixXd& y) const {
    const double sy = s_.col(i).dot(y.col(i));
    return sy > 1e-8 * s_.col(i).norm() * y.col(i).norm() ? 1.0 / sy : 0.0;
  }

  bool with_term_;
  Eigen::MatrixXd s_, y_, total_;
  Eigen::VectorXd rho_, weight_;
  Eigen::Index count_ = 0;
};

}  // namespace tandem::detail
