#pragma once

#include <optional>
#include <vector>

#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/saved_noise.hpp>
#include <tandem/studies/calibration/model_parameters.hpp>
#include <tandem/studies/calibration/noise_parameters.hpp>

namespace tandem {

/// The problems of scenarios, and the parameters to calibrate. Parameters are numbered: first the noise groups, then
/// the model parameters that problems are built from.
class ScenarioProblems {
 public:
  /// Builds the problems with the given values, unsolved. `options` must outlive this object. Throws Error on unknown
  /// names in `free`, and as CalibrationProblem.
  ScenarioProblems(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options);
  ScenarioProblems(const ScenarioProblems&) = delete;

  const CalibrationProblems& all() const { return problems_; }  ///< one per scenario
  const std::vector<Problem*>& raw_problems() const { return raw_problems_; }
  const NoiseParameters& noise() const { return noise_; }
  const std::vector<ModelParameter>& model_parameters() const { return model_parameters_; }
  std::size_t num_parameters() const { return noise_.groups.size() + model_parameters_.size(); }
  std::vector<MeasuredBlock> measured() const;
  int measured_rows() const;  ///< total number of rows of all measurements

  /// Calibrates the parameters. The problems must be solved with the given values, and are left solved with the
  /// calibrated ones, unless stopped. The counts of iterations and solves include all earlier calls. With model
  /// parameters, iterations are steps of these, and the message says how often problems were built.
  Calibration calibrate(const CalibrationOptions& options, std::vector<CalibratedParameter>& parameters);
  /// Cross-validates the calibration. The problems must have the given values.
  CrossValidation cross_validate(const std::vector<std::vector<HeldOutMeasurement>>& folds,
                                 const CalibrationOptions& options);
  /// Removes a parameter from calibration. Takes effect in the problems at the next restore_given().
  void keep_given(std::size_t parameter);
  /// Restores the given values and solves the problems.
  void restore_given();

  /// Returns the complete noise entries of all parameters, with the given values.
  std::vector<NoiseEntry> given_entries() const;
  /// Multiplies `entries` by the calibrated factors of the parameters, which are in the order of this class.
  void apply_factors(const std::vector<CalibratedParameter>& found, std::vector<NoiseEntry>& entries) const;

 private:
  CalibrationOptions with_current_blocks(CalibrationOptions options) const;
  CalibrationProblems build_by(std::vector<Scenario> scenarios, const Eigen::VectorXd& values) const;
  BuiltProblems build(const Eigen::VectorXd& values) const;
  void rebuild_at(const Eigen::VectorXd& values);
  void solve();
  Eigen::VectorXd given_values() const;
  std::vector<BuiltParameter> built_parameters() const;

  const ScenarioCalibrationOptions& options_;
  std::vector<ModelParameter> model_parameters_;
  std::vector<ModelParameterEntry> model_parameter_entries_;  // all known ones
  ScenarioCalibrationOptions noise_options_;                  // `free` without model parameters
  std::vector<Scenario> scenarios_;                // sources of rebuilt problems; empty without model parameters
  CalibrationProblems problems_, given_problems_;  // given_problems_: the initial ones, after a rebuild
  std::vector<Problem*> raw_problems_;             // pointers to problems_
  NoiseParameters noise_;
  detail::SavedNoise given_;
  int iterations_ = 0, solves_ = 0;  // sums over all calls of calibrate()
};

}  // namespace tandem
