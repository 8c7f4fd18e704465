#pragma once

#include <vector>

#include <tandem/residuals/loss.hpp>
#include <tandem/solvers/calibration/calibrate_built.hpp>

namespace tandem {

/// A measurement that cross-validation holds out and predicts.
struct HeldOutMeasurement {
  Block block;
  int problem = 0;     ///< index of its problem among those that are calibrated together
  Loss loss{};         ///< given loss of the block
  bool scored = true;  ///< false: held out with its fold, but not part of the score
};

/// A held-out measurement compared with its prediction from all other folds.
struct HeldOutPrediction {
  std::size_t fold, index;     ///< position in the folds
  Eigen::VectorXd residual;    ///< residual in the measurement's units
  Eigen::MatrixXd covariance;  ///< covariance of the residual: prediction plus noise
  /// log_density() under the loss of the block. If calibration changed the loss, includes the difference of
  /// log_constant().
  double log_likelihood = 0;

  /// Returns log N(residual; 0, covariance). A robust loss replaces the square by ρ and the number of rows by
  /// counted_rows(), so that the mean is largest at the covariance of the inliers.
  double log_density(const Loss& loss) const;
  /// Returns rᵀ S⁻¹ r with S the covariance.
  double squared_distance() const;
};

struct CrossValidation {
  std::vector<HeldOutPrediction> given, found;  ///< With the given noise; with the noise calibrated without the fold.
  double given_log_likelihood = 0, found_log_likelihood = 0;  ///< Sums over the scored measurements.
  double gain = 0;                                            ///< found_log_likelihood − given_log_likelihood.
  double gain_error = 0;     ///< Standard error of the gain, from its variation over the folds.
  bool complete = false;     ///< False if stopped, or if a fold could not be solved.
  std::string why;           ///< The reason if not complete.
  std::string unobservable;  ///< The directions, if these are the reason.
};

/// Cross-validates noise calibration. Predicts the measurements of each fold from all other data, with the given noise
/// and with the noise calibrated on that other data. Measurements are held out by multiplying their noise by 10⁵. Works
/// on copies, so the problems do not change. Throws Error like calibrate().
CrossValidation cross_validate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                               const std::vector<std::vector<HeldOutMeasurement>>& folds,
                               const CalibrationOptions& options = {});
/// Cross-validates calibrate_built(), with parameters and noise estimated without each fold. `problems` are built from
/// the given values; those of `build` must have the same measured blocks.
CrossValidation cross_validate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                               const std::vector<std::vector<HeldOutMeasurement>>& folds, const BuildProblems& build,
                               const std::vector<BuiltParameter>& parameters, const CalibrationOptions& options = {});

}  // namespace tandem
