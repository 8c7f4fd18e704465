#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <tandem/solvers/calibration/laplace_approximation.hpp>
#include <tandem/solvers/calibration/tail_term.hpp>

namespace tandem::detail {

/// Sum of the tail_term()s of a problem over its Student's t measurements, and the derivatives of this sum. The sum and
/// log det H depend on the noise directly, through the Hessian H, and through the solution, which sets the weights ρ′.
class Tails {
 public:
  /// Computes the terms at the last find_covariances(). Returns false if the perturbed Hessian cannot be inverted.
  /// Without student_t_blocks(), there are no terms and the result is true.
  bool find(LaplaceApproximation& laplace);

  bool any() const { return !terms_.empty(); }
  double value() const { return value_; }  ///< sum of the terms
  /// Returns the term of a block, or null if it has none.
  const TailTerm* of(const Block& block) const;
  /// Returns the block D of variables, stacked in the order of their ids, such that a change dH of the Hessian changes
  /// the sum by tr(D dH).
  Eigen::MatrixXd hessian_derivative(const std::vector<int>& variable_ids, const std::vector<int>& dofs) const;
  /// Returns the derivative of the sum − ½ log det H by the log noise factor of each row of a block, which may have any
  /// loss. Includes the change of the solution and of the block's own term, but not the change of the Hessian.
  Eigen::VectorXd noise_derivative(const LaplaceApproximation& laplace, const Block& block,
                                   const Problem::Linearization& at) const;

 private:
  /// A linearised, whitened block.
  struct WhitenedBlock {
    Loss loss;
    Eigen::VectorXd r;
    Eigen::MatrixXd J;
    std::vector<int> variable_ids, dofs;
  };
  bool differentiate_by_hessian(LaplaceApproximation& laplace);
  void differentiate_by_solution(LaplaceApproximation& laplace);
  Eigen::VectorXd whitened_step(const WhitenedBlock& by, const Eigen::VectorXd& step) const;
  void add_gradient(const WhitenedBlock& by, const Eigen::VectorXd& rows, Eigen::VectorXd& gradient) const;

  const NlpEvaluator* nlp_ = nullptr;
  std::vector<WhitenedBlock> blocks_;                         // LaplaceApproximation::student_t_blocks()
  std::vector<TailTerm> terms_;                               // one per block
  std::map<std::pair<int, int>, std::size_t> term_of_block_;  // index in terms_ by pool and id
  double value_ = 0;
  // D is a central difference of the inverse Hessian, perturbed by the derivatives of the terms by the covariances.
  std::unique_ptr<SelectedInverse> inverse_plus_, inverse_minus_;
  double step_width_ = 0;  // 0: no difference was taken
  // H⁻¹ h over all unknowns, where h is the derivative of the sum − ½ log det H by the solution.
  Eigen::VectorXd by_solution_;
};

}  // namespace tandem::detail
