#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <tandem/solvers/calibration/settled_problem.hpp>
#include <tandem/solvers/calibration/tail_term.hpp>

namespace tandem::detail {

/// The tail_term()s of what is measured under Student's t in a problem, and what else changes their sum and the logarithm of the
/// Hessian's determinant beside noise: the Hessian, and the solution, on which both depend by the weights ρ′.
class Tails {
 public:
  /// At the last find_covariances(); false where the Hessian cannot be inverted beside its own. Nothing, and true, where
  /// SettledProblem::student_t() is.
  bool find(SettledProblem& settled);

  bool any() const { return !terms_.empty(); }
  /// The sum of the terms.
  double value() const { return value_; }
  /// Of a block under Student's t; null where it has no term.
  const TailTerm* of(const Block& block) const;
  /// D of variables by their ids, one after the other: a change dH of the Hessian changes the sum by tr(D dH).
  Eigen::MatrixXd by_hessian(const std::vector<int>& variable_ids, const std::vector<int>& dofs) const;
  /// What the sum and −½ log det H change by with the logarithm of a factor on each row's standard deviation of a block, under
  /// Student's t or not, beside what they do by the Hessian: by the solution, and by the block's own term.
  Eigen::VectorXd by_noise(const SettledProblem& settled, const Block& block, const Problem::Linearization& at) const;

 private:
  /// A block as it is linearised, whitened.
  struct Whitened {
    Loss loss;
    Eigen::VectorXd r;
    Eigen::MatrixXd J;
    std::vector<int> variable_ids, dofs;
  };
  bool find_by_hessian(SettledProblem& settled);
  void find_by_solution(SettledProblem& settled);
  Eigen::VectorXd moved(const Whitened& by, const Eigen::VectorXd& step) const;
  void pull(const Whitened& by, const Eigen::VectorXd& rows, Eigen::VectorXd& gradient) const;

  const Program* program_ = nullptr;
  std::vector<Whitened> blocks_;                       // SettledProblem::student_t()
  std::vector<TailTerm> terms_;                        // of these
  std::map<std::pair<int, int>, std::size_t> places_;  // of these, by pool and id
  double value_ = 0;
  // D is the difference quotient of the inverse along the terms' own derivatives by covariances.
  std::unique_ptr<SelectedInverse> more_, less_;
  double apart_ = 0;  // 0: there is none
  // H⁻¹ h, h the derivative by the solution of the sum and of −½ log det H; of all unknowns.
  Eigen::VectorXd by_solution_;
};

}  // namespace tandem::detail
