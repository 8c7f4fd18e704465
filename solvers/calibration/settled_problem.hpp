#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/lanes.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/linear/selected_inverse.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem::detail {

/// Times the noise of what is measured, beside beliefs all but alone: a millionth of its information. Where the integral is to
/// be whole, the noise is that as given, so that no factor tells on it, and the information less.
inline constexpr double kFaint = 1e3, kFaintWhole = 1e5;

/// A problem that is solved again and again as its noise changes, and the covariances at its solution: patterns and
/// symbolic analyses once. Near the last solution Gauss-Newton steps do, but not where there are hard blocks, or where
/// CalibrationOptions::solve says how. Its constructor and functions throw Stopped where it is to stop.
class SettledProblem {
 public:
  /// `measured`: blocks of the problem; none: there is no second kind of covariance.
  SettledProblem(Problem& problem, const CalibrationOptions& options, std::vector<Block> measured);
  SettledProblem(const SettledProblem&) = delete;

  Problem& problem() { return problem_; }
  const Problem& problem() const { return problem_; }
  /// Solves from where the problem is by steps alone; false when they do not lead there: it is where it was.
  bool settle_by_steps();
  /// The same by a whole solve; false, and why(), when that fails.
  bool settle();
  /// Covariances at the solution, with all blocks and with beliefs all but alone; false, and why(), where there are none.
  bool find_covariances();
  const std::string& why() const { return why_; }
  /// Where the problem is, for go_back(), from where it is solved next by steps again: another noise may have led to a
  /// solution without covariances, as a target that falls onto what it is seen from, out of which no solve leads.
  void keep_place();
  void go_back();

  double cost() const { return cost_; }  ///< of the last solve
  /// Of the last find_covariances().
  struct Covariances {
    const Program* program = nullptr;
    const SelectedInverse* inverse = nullptr;
    const Marginals* marginals = nullptr;  ///< in their place, where there are hard blocks

    double log_determinant() const;  ///< of the Hessian
    /// Of variables by their ids, one after the other.
    Eigen::MatrixXd joint(const std::vector<int>& variable_ids, const std::vector<int>& dofs) const;
  };
  Covariances covariances() const { return {&program_, &inverse_, marginals_ ? &*marginals_ : nullptr}; }
  bool has_beliefs() const { return !measured_.empty(); }
  /// CalibrationOptions::whole_integral: the least cost of beliefs, what is measured all but alone, and the step to it from the
  /// solution, of all unknowns; empty, and 0, where that is not asked for or known.
  double beliefs_cost() const { return beliefs_cost_; }
  const Eigen::VectorXd& beliefs_step() const { return beliefs_step_; }
  const Program& program() const { return program_; }
  /// The inverse of the last find_covariances()'s Hessian, or of its beliefs', times columns; false where there are hard
  /// blocks, or it cannot be factorised.
  bool solve(Eigen::MatrixXd& columns, bool of_beliefs);
  /// The same in two parts: of one column after the other.
  bool factorize(bool of_beliefs);
  void solve_factorized(Eigen::VectorXd& column) { cholesky_.solve(column); }
  /// What is measured under Student's t, whose curvature counts as is to be expected of it (expected_curvature); none where there
  /// are hard blocks, or CalibrationOptions::solve.
  const std::vector<Block>& student_t() const { return student_t_; }
  /// Of the last find_covariances()'s Hessian with Σ (W J)ᵀ T (W J) beside it, T of each of these and W its noise's; false where it
  /// cannot be inverted.
  bool invert_tilted(const std::vector<Eigen::MatrixXd>& tilts, SelectedInverse& inverse);
  Covariances of_beliefs() const {
    return {&program_, &beliefs_inverse_, beliefs_marginals_ ? &*beliefs_marginals_ : nullptr};
  }

 private:
  const SymmetricPattern& pattern() const;
  class Faint;
  class AsExpected;
  void linearize();
  void take_hold(double share);
  void hold_loosely();
  void step_to_beliefs(double cost);

  Problem& problem_;
  std::optional<Problem> place_;
  const CalibrationOptions& options_;
  std::vector<Block> measured_;
  std::vector<Gaussian> faint_;  // of each, where its noise as given says it
  std::vector<Block> student_t_;
  bool by_steps_;  // whether undamped steps may do
  bool near_ = false;
  Program program_;
  Lanes lanes_;
  BlockCholesky cholesky_;
  SelectedInverse inverse_, beliefs_inverse_;
  std::optional<Marginals> marginals_, beliefs_marginals_;  // where not by steps
  Eigen::VectorXd gradient_, beliefs_hessian_, hessian_, step_, hold_;
  bool linearized_ = false;  // hessian_ is that at the solution
  double cost_ = 0, beliefs_cost_ = 0;
  Eigen::VectorXd beliefs_step_;
  std::string why_;
};

}  // namespace tandem::detail
