#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/studies/calibration/misfit.hpp>
#include <tandem/studies/scenario/noise_file.hpp>

namespace tandem {

struct ScenarioCalibrationOptions {
  std::vector<std::string> free;  ///< Noise entries ("usbl") and parameters ("usbl.x"); empty: all that have residuals.
  bool noise = true;              ///< False: keeps the given noise and estimates constant systematic errors only.
  double prior = 1.0;             ///< NoiseGroup::prior of all groups.
  int folds = 5;                  ///< Number of cross-validation folds; 0: none.
  int profile_points = 0;         ///< CalibrationOptions::profile_points; if positive, also profiles the constants.
  TrackingOptions target{};
  NavigationOptions own{};
  Stop stop{};                                            ///< ends the calibration with the best estimates so far
  std::function<void(const std::string& what)> progress;  ///< called with "iteration 3, evidence +12.3"
};

/// The reason why a parameter keeps its given value although an estimate exists.
enum class KeepReason {
  none,      ///< the estimate is accepted
  at_limit,  ///< the estimate ran to CalibrationOptions::max_factor
  /// Smaller noise, but residuals that it explains have a mean or are correlated (Misfit). A sensor explains its own
  /// residuals, a motion model those of all sensors.
  misfit,
  untested,  ///< smaller noise of dead reckoning, but gaps without fixes are longer than the held-out segments
};

/// A calibrated standard deviation, time constant or number of degrees of freedom.
struct CalibratedParameter {
  std::string name;  ///< "usbl.x"
  double given = 0;  ///< given value in the units of the scenario files
  CalibratedNoise result;
  KeepReason keep_reason = KeepReason::none;  ///< if not none, result.factor is 1

  double found() const { return given * result.factor; }  ///< calibrated value
};

/// A constant systematic error of a sensor, estimated in one scenario.
struct CalibratedConstant {
  std::string scenario;
  SystematicErrorEstimate found;
  /// Profile evidence of a scalar constant: values around the estimate, and the log evidence of the data there minus
  /// that at the estimate. Empty without ScenarioCalibrationOptions::profile_points.
  std::vector<std::pair<double, double>> profile{};
};

/// Predictive log-likelihood of the held-out measurements of one scenario.
struct HeldOutScore {
  std::string scenario;
  int measurements = 0;
  double given = 0, found = 0;  ///< mean per measurement, with the given and with the calibrated noise
};

struct ScenarioCalibration {
  std::vector<std::string> scenarios;
  Calibration summary;
  std::vector<CalibratedParameter> parameters;
  std::vector<CalibratedConstant> constants;  ///< estimated with the recommended noise
  /// Sentences that name parameters without calibration or cross-validation, and the reason.
  std::vector<std::string> notes;
  std::vector<Misfit> before, after;  ///< residual statistics with the given and with the calibrated noise
  int folds = 0;                      ///< 0: no cross-validation
  std::vector<HeldOutScore> scores;   ///< one per scenario
  double gain = 0, gain_error = 0;    ///< gain in predictive log-likelihood and its standard error
  std::string why_not_validated;      ///< the reason if cross-validation failed
  double seconds = 0;
  bool cut_short = false;  ///< whether it was stopped early, and not cross-validated

  /// Returns whether the calibrated noise predicts held-out measurements better, by more than the standard error.
  bool recommended() const { return folds > 0 && why_not_validated.empty() && gain > gain_error; }
  /// Noise entries with calibrated values; equals given_noise if calibration is not recommended, or if it was cut short
  /// before cross-validation recommended it.
  std::vector<NoiseEntry> noise;
  std::vector<NoiseEntry> given_noise;
};

/// Calibrates the noise that scenarios share, from their measurements alone; truth is not used. The noise of the first
/// scenario is the given noise of all.
///
/// A parameter keeps its given value for each KeepReason, and the others are then calibrated again. For example, white
/// noise must not shrink while residuals are correlated: the estimated covariance would be too small.
///
/// Constant systematic errors are estimated in each scenario separately and cross-validated. If gaps without position
/// fixes are longer than the held-out segments, a constant of the chaser's own sensors that has no gain gets no
/// verdict.
///
/// Throws Error if the sensors of the scenarios differ, a name is unknown, a parameter has no residuals, or there are
/// fewer measured values than parameters. Also throws like the problem builders and calibrate().
ScenarioCalibration calibrate_scenarios(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options);

}  // namespace tandem
