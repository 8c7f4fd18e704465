#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <tandem/solvers/calibration/laplace_approximation.hpp>
#include <tandem/solvers/calibration/tail_term.hpp>

namespace tandem::detail {

/// The terms that robust losses add to the evidence of a problem and to its derivatives.
///
/// The Hessian H has the weights ρ′ of the losses. Hence log det H depends on the noise also through these weights:
/// directly, and through the solution. Student's t measurements add the sum of their tail_term()s, which depends on the
/// noise in the same ways. The derivatives neglect the change of Jacobians with the solution.
class LossTerms {
 public:
  /// Computes the terms at the last find_covariances(). Returns false if the perturbed Hessian cannot be inverted.
  /// Without a robust loss, there are no terms and the result is true.
  bool find(LaplaceApproximation& laplace);

  bool any() const { return !blocks_.empty(); }
  double value() const { return value_; }  ///< sum of the tail_term()s
  /// Returns the tail term of a block, or null if it has none.
  const TailTerm* of(const Block& block) const;
  /// Returns the block D of variables, stacked in the order of their ids, such that a change dH of the Hessian changes
  /// value() by tr(D dH).
  Eigen::MatrixXd hessian_derivative(const std::vector<int>& variable_ids, const std::vector<int>& dofs) const;
  /// Returns the derivative of value() − ½ log det H by the log noise factor of each row of a block, which may have any
  /// loss. Includes the change of the solution and of the block's own term, but not the direct change of the Hessian.
  Eigen::VectorXd noise_derivative(const LaplaceApproximation& laplace, const Block& block,
                                   const Problem::Linearization& at) const;

 private:
  /// A linearised, whitened block with a robust loss.
  struct WhitenedBlock {
    Loss loss;
    double curvature;  // of H, relative to the weight: expected_curvature() if H has it, else 1
    Eigen::VectorXd r;
    Eigen::MatrixXd J;
    std::vector<int> variable_ids, dofs;
    Eigen::MatrixXd V;  // J S Jᵀ with S the covariance of the variables
    double leverage;    // trace of V, for a prior minus that under the priors alone
  };
  void add_block(const LaplaceApproximation& laplace, const Block& block, bool measured, double curvature);
  bool differentiate_by_hessian(LaplaceApproximation& laplace);
  void differentiate_by_solution(const LaplaceApproximation& laplace);
  Eigen::VectorXd curvature_difference(const Eigen::VectorXd& step) const;
  void add_gradient(const WhitenedBlock& by, const Eigen::VectorXd& rows, Eigen::VectorXd& gradient) const;

  const NlpEvaluator* nlp_ = nullptr;
  std::vector<WhitenedBlock> blocks_;                         // first those with a tail term
  std::vector<TailTerm> terms_;                               // of LaplaceApproximation::student_t_blocks()
  std::map<std::pair<int, int>, std::size_t> term_of_block_;  // index in terms_ by pool and id
  double value_ = 0;
  // D is a central difference of the inverse Hessian, perturbed by the derivatives of the terms by the covariances.
  std::unique_ptr<SelectedInverse> inverse_plus_, inverse_minus_;
  double step_width_ = 0;  // 0: no difference was taken
  // The derivative of value() − ½ log det H by the solution, multiplied by the inverse of the Hessian of the cost.
  Eigen::VectorXd by_solution_;
};

}  // namespace tandem::detail
