#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/calibration/saved_values.hpp>
#include <tandem/solvers/linear/selected_inverse.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem::detail {

/// The solution of a problem and the covariances there, updated as the noise changes. Sparsity patterns are analysed
/// once. Near the last solution, Gauss-Newton steps suffice, unless there are hard blocks or CalibrationOptions::solve
/// is given. "Prior" means all blocks that are not measurements. All functions throw Stopped on a stop request.
class LaplaceApproximation {
 public:
  /// `measured`: the measurements of the problem. Empty: no prior covariances are computed.
  LaplaceApproximation(Problem& problem, const CalibrationOptions& options, std::vector<Block> measured);
  LaplaceApproximation(const LaplaceApproximation&) = delete;

  Problem& problem() { return problem_; }
  const Problem& problem() const { return problem_; }
  /// Solves with Gauss-Newton steps from the current values. On failure, returns false and keeps the values.
  bool update_by_steps();
  /// Solves with the full solver. On failure, returns false and sets why().
  bool update();
  /// Computes the covariances at the solution, with all blocks and with the prior alone. On failure, returns false and
  /// sets why().
  bool find_covariances();
  const std::string& why() const { return why_; }                    ///< the reason of the last failure
  const std::string& unobservable() const { return unobservable_; }  ///< the directions, if these are the reason
  /// Saves the values of the variables for restore_values(); initially those at construction. Needed because some noise
  /// leads to a solution without covariances that later solves cannot leave, e.g. a target that coincides with the
  /// chaser.
  void save_values();
  void restore_values();

  double cost() const { return cost_; }  ///< at the last solution
  /// The result of the last find_covariances().
  struct Covariances {
    const NlpEvaluator* nlp = nullptr;
    const SelectedInverse* inverse = nullptr;
    const Marginals* marginals = nullptr;  ///< used instead if there are hard blocks

    double log_determinant() const;  ///< log det of the Hessian
    /// Returns the joint covariance of variables, stacked in the order of their ids; zero for fixed variables.
    Eigen::MatrixXd joint(const std::vector<int>& variable_ids, const std::vector<int>& dofs) const;
    /// Returns J S Jᵀ for the joint covariance S of variables. It is accurate also if J observes only differences of
    /// states with large variances.
    Eigen::MatrixXd propagated(const Eigen::MatrixXd& J, const std::vector<int>& variable_ids,
                               const std::vector<int>& dofs) const;
    /// Returns the product of the covariance of all unknowns and a vector.
    Eigen::VectorXd times(const Eigen::VectorXd& x) const;
  };
  Covariances covariances() const { return {&nlp_, &inverse_, marginals_ ? &*marginals_ : nullptr}; }
  Covariances prior_covariances() const {
    return {&nlp_, &prior_inverse_, prior_marginals_ ? &*prior_marginals_ : nullptr};
  }
  bool has_prior_term() const { return !measured_.empty(); }
  /// The minimum of the prior cost, with downweighted measurements, and the step to it from the solution, over all
  /// unknowns. Only with CalibrationOptions::absolute_evidence; else, and if unknown, 0 and empty.
  double prior_cost() const { return prior_cost_; }
  const Eigen::VectorXd& prior_step() const { return prior_step_; }
  const NlpEvaluator& nlp() const { return nlp_; }
  /// Measurements with a Student's t loss. The Hessian has their expected_curvature(). Empty if there are hard blocks,
  /// or if CalibrationOptions::solve is given.
  const std::vector<Block>& student_t_blocks() const { return student_t_blocks_; }
  /// The other blocks with a robust loss, and whether each is a measurement. The Hessian has their weights ρ′.
  const std::vector<std::pair<Block, bool>>& weighted_blocks() const { return weighted_blocks_; }
  /// Returns false if there are hard blocks, or if CalibrationOptions::solve is given.
  bool by_steps() const { return by_steps_; }
  /// Inverts the Hessian of the last find_covariances() plus Σ (W J)ᵀ T (W J) over student_t_blocks(). T is the
  /// perturbation of a block and W its whitening matrix. Returns false if the sum cannot be inverted.
  bool invert_perturbed(const std::vector<Eigen::MatrixXd>& perturbations, SelectedInverse& inverse);

 private:
  const SymmetricPattern& pattern() const;
  class DownweightedMeasurements;
  class ExpectedCurvature;
  void linearize();
  bool has_losses() const { return !student_t_blocks_.empty() || !weighted_blocks_.empty(); }
  bool invert_prior();
  void find_prior_minimum();
  std::vector<WhitenedRows> prior_rows();

  Problem& problem_;
  SavedValues saved_values_;
  const CalibrationOptions& options_;
  std::vector<Block> measured_;
  std::vector<Gaussian> downweighted_;  // noise of each for the integral of the priors
  std::vector<Block> student_t_blocks_;
  std::vector<std::pair<Block, bool>> weighted_blocks_;
  bool by_steps_;  // Gauss-Newton steps are allowed
  bool near_solution_ = false;
  NlpEvaluator nlp_;
  TaskRunner task_runner_;
  BlockCholesky cholesky_;
  SelectedInverse inverse_, prior_inverse_;
  std::optional<Marginals> marginals_, prior_marginals_;  // if not by_steps_, or after weak pivots
  Eigen::VectorXd gradient_, prior_gradient_, prior_hessian_, hessian_, step_;
  bool linearized_ = false;  // hessian_ is up to date
  bool prior_by_rows_ = false;
  double cost_ = 0, cost_of_priors_ = 0;
  double prior_cost_ = 0;
  Eigen::VectorXd prior_step_;
  std::string why_, unobservable_;
};

}  // namespace tandem::detail
