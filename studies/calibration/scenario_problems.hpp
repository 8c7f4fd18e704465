#pragma once

#include <optional>
#include <vector>

#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/saved_noise.hpp>
#include <tandem/studies/calibration/noise_parameters.hpp>
#include <tandem/studies/calibration/scenario_numbers.hpp>

namespace tandem {

/// Scenarios' problems, by what is given or by what was found: noise, and numbers that problems are built by. Parameters are
/// those of noise, then the numbers.
class ScenarioProblems {
 public:
  /// As given, not solved. `options` have to live as long. Throws Error on names of `free` that are not there, and as
  /// CalibrationProblem does.
  ScenarioProblems(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options);
  ScenarioProblems(const ScenarioProblems&) = delete;

  const CalibrationProblems& all() const { return problems_; }
  const std::vector<Problem*>& plain() const { return plain_; }
  const NoiseParameters& noise() const { return noise_; }
  const std::vector<ScenarioNumber>& numbers() const { return numbers_; }
  std::size_t num_parameters() const { return noise_.groups.size() + numbers_.size(); }
  std::vector<MeasuredBlock> measured() const;
  int measured_rows() const;

  /// Finds the parameters, from problems that are solved as given; the problems are then solved by them, unless it is to stop.
  /// Iterations (with numbers, steps of these) and solves are those of all calls so far, since some parameters may be kept and
  /// the rest found again; with numbers, the message tells how often problems were built.
  Calibration calibrate(const CalibrationOptions& options, std::vector<CalibratedParameter>& parameters);
  /// From problems as given.
  CrossValidation cross_validate(const std::vector<std::vector<LeftOut>>& folds, const CalibrationOptions& options);
  /// A parameter is one no more; problems have it as given from put_back() on.
  void keep_given(std::size_t parameter);
  /// To what is given, solved.
  void put_back();

  /// Of the parameters that there are, whole entries as given.
  std::vector<NoiseEntry> given_entries() const;
  /// Entries with what was found of parameters, in their order.
  void put(const std::vector<CalibratedParameter>& found, std::vector<NoiseEntry>& entries) const;

 private:
  CalibrationProblems build_by(std::vector<Scenario> scenarios, const Eigen::VectorXd& values) const;
  BuiltProblems build(const Eigen::VectorXd& values) const;
  void move_to(const Eigen::VectorXd& values);
  void solve();
  Eigen::VectorXd given_values() const;
  std::vector<BuiltParameter> built_parameters() const;

  const ScenarioCalibrationOptions& options_;
  std::vector<ScenarioNumber> numbers_;
  std::vector<NumberEntry> number_entries_;  // that there might be
  ScenarioCalibrationOptions of_noise_;      // its `free` names no numbers
  std::vector<Scenario> kept_;               // to be built anew; none where there are no numbers
  CalibrationProblems problems_, as_given_;  // the latter as they were solved at first, once there are others
  std::vector<Problem*> plain_;              // of problems_
  NoiseParameters noise_;
  detail::SavedNoise given_;
  int iterations_ = 0, solves_ = 0;  // of all calibrations
};

}  // namespace tandem
