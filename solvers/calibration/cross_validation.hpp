#pragma once

#include <vector>

#include <tandem/residuals/loss.hpp>
#include <tandem/solvers/calibration/calibrate_built.hpp>

namespace tandem {

/// A measurement that a cross-validation leaves out and predicts.
struct LeftOut {
  Block block;
  int problem = 0;     ///< of the problems that are calibrated together, the one whose block it is
  Loss loss{};         ///< what counts for an outlier; the block's own
  bool scored = true;  ///< false: it is left out with the others of its fold, and says nothing of its own
};

/// A left-out measurement against its prediction out of all others.
struct LeftOutPrediction {
  std::size_t fold, index;
  Eigen::VectorXd residual;    ///< in the measurement's units
  Eigen::MatrixXd covariance;  ///< of the residual: the prediction's and the noise's together
  double log_likelihood =
      0;  ///< log_density() under the block's loss; of one that was built anew, with the change in its
          ///< loss's log_constant()

  /// log N(residual; 0, covariance); under a loss with ρ in place of the square and its rows as counted_rows() has them, so
  /// that it is greatest on average at the covariance of what is no outlier.
  double log_density(const Loss& loss) const;
  /// rᵀ S⁻¹ r.
  double squared_distance() const;
};

struct CrossValidation {
  std::vector<LeftOutPrediction> given, found;  ///< by the noise as it was given; as found without the fold
  double given_log_likelihood = 0, found_log_likelihood = 0;  ///< sums over what is scored
  double gain = 0;                                            ///< found − given
  double gain_error = 0;  ///< standard error of the gain, from the differences of the folds' stretches
  bool complete = false;  ///< false: stopped, or a fold could not be solved
  std::string why;        ///< it is not
};

/// Predicts every fold's measurements out of all other data, once with the noise as it was given and once with factors found
/// without them, from where the problems are and with the noise that they have now as given. A measurement is left out by a
/// noise 10⁵ times its own. The problems are left as they came, solved. Throws Error as calibrate() does.
CrossValidation cross_validate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                               const std::vector<std::vector<LeftOut>>& folds, const CalibrationOptions& options = {});
/// The same where parameters of calibrate_built() are found without a fold, too. `problems` are as built by the values given, and
/// `build`'s have the same measured blocks.
CrossValidation cross_validate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                               const std::vector<std::vector<LeftOut>>& folds, const BuildProblems& build,
                               const std::vector<BuiltParameter>& parameters, const CalibrationOptions& options = {});

}  // namespace tandem
