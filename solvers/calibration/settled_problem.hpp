#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/lanes.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/linear/selected_inverse.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem::detail {

/// Times the noise of what is measured, beside beliefs all but alone: a millionth of its information.
inline constexpr double kFaint = 1e3;

/// A problem that is solved again and again as its noise changes, and the covariances at its solution: patterns and
/// symbolic analyses once. Near the last solution Gauss-Newton steps do, but not where there are hard blocks, or where
/// CalibrationOptions::solve says how. Its constructor and functions throw Stopped where it is to stop.
class SettledProblem {
 public:
  /// `measured`: blocks of the problem; none: there is no second kind of covariance.
  SettledProblem(Problem& problem, const CalibrationOptions& options, std::vector<Block> measured);
  SettledProblem(const SettledProblem&) = delete;

  Problem& problem() { return problem_; }
  /// Solves from where the problem is by steps alone; false when they do not lead there: it is where it was.
  bool settle_by_steps();
  /// The same by a whole solve; false, and why(), when that fails.
  bool settle();
  /// Covariances at the solution, with all blocks and with beliefs all but alone; false, and why(), where there are none.
  bool find_covariances();
  const std::string& why() const { return why_; }

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
  const Program& program() const { return program_; }
  /// The inverse of the last find_covariances()'s Hessian, or of its beliefs', times columns; false where there are hard
  /// blocks, or it cannot be factorised.
  bool solve(Eigen::MatrixXd& columns, bool of_beliefs);
  Covariances of_beliefs() const {
    return {&program_, &beliefs_inverse_, beliefs_marginals_ ? &*beliefs_marginals_ : nullptr};
  }

 private:
  const SymmetricPattern& pattern() const;
  class Faint;
  void scale_measured(double factor);
  void linearize();
  void hold_loosely();

  Problem& problem_;
  const CalibrationOptions& options_;
  std::vector<Block> measured_;
  bool by_steps_;  // whether undamped steps may do
  bool near_ = false;
  Program program_;
  Lanes lanes_;
  BlockCholesky cholesky_;
  SelectedInverse inverse_, beliefs_inverse_;
  std::optional<Marginals> marginals_, beliefs_marginals_;  // where not by steps
  Eigen::VectorXd gradient_, beliefs_hessian_, hessian_, step_, hold_;
  bool linearized_ = false;  // hessian_ is that at the solution
  double cost_ = 0;
  std::string why_;
};

}  // namespace tandem::detail
