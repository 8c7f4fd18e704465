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
  std::vector<std::string> free;  ///< entries ("usbl") and parameters ("usbl.x"); none: all that have data
  bool noise = true;              ///< false: none; errors that stay are found by the noise as given
  double prior = 1.0;             ///< NoiseGroup::prior of each
  int folds = 5;                  ///< of the cross-validation; 0: none
  int profile = 0;                ///< CalibrationOptions::profile; of constants seven points, where any are asked for
  TrackingOptions target{};
  NavigationOptions own{};
  Stop stop{};                                            ///< ends it at the best noise so far
  std::function<void(const std::string& what)> progress;  ///< "iteration 3, evidence +12.3"
};

/// Why noise other than given, though found, is not believed.
enum class Distrust {
  none,
  at_bound,  ///< it came to the end of what is allowed, and would go on
  misfit,    ///< less of it: residuals have a mean or stay, which noise does not explain
  untried,  ///< less of it: dead reckoning rests on it for longer than is held out at once, and nothing tells what stays so long
};

/// A standard deviation that was calibrated, or found to be beyond it.
struct CalibratedParameter {
  std::string name;  ///< "usbl.x"
  double given = 0;  ///< in the units of the scenario's files
  CalibratedNoise result;
  Distrust distrust = Distrust::none;  ///< else it is kept as given

  double found() const { return given * result.factor; }
};

/// A constant of a sensor's errors that stay, as found in one of the scenarios.
struct CalibratedConstant {
  std::string scenario;
  FoundConstant found;
  /// Values around the one found, of one that is a single number, and the logarithm of the data's evidence there against it,
  /// all else as likeliest; where ScenarioCalibrationOptions::profile asks for it.
  std::vector<std::pair<double, double>> profile{};
};

/// How well held-out measurements were predicted, by noise as given and as found without them.
struct HeldOutScore {
  std::string scenario;
  int measurements = 0;
  double given = 0, found = 0;  ///< mean log likelihood of a measurement
};

struct ScenarioCalibration {
  std::vector<std::string> scenarios;
  Calibration summary;
  std::vector<CalibratedParameter> parameters;
  std::vector<CalibratedConstant> constants;  ///< by the noise that is recommended
  std::vector<std::string> held;              ///< sentences: what was not calibrated or tried, and why
  std::vector<Misfit> before, after;
  int folds = 0;                     ///< 0: nothing was held out
  std::vector<HeldOutScore> scores;  ///< of each scenario
  double gain = 0, gain_error = 0;   ///< of the log likelihood of all held-out measurements
  std::string why_not_validated;     ///< the cross-validation has no answer, a sentence
  double seconds = 0;
  bool cut_short = false;  ///< by the stop, with the best found by then, not tried to the end

  /// Found noise predicts what was held out better than given noise: on the whole by more than its standard error.
  bool recommended() const { return folds > 0 && why_not_validated.empty() && gain > gain_error; }
  /// Entries of the parameters with what was found; as given where it is not recommended.
  std::vector<NoiseEntry> noise;
  std::vector<NoiseEntry> given_noise;
};

/// Calibrates the noise that scenarios share out of their measurements alone: no truth is read. What the first one gives
/// is taken as given for all. White noise that is made smaller while errors stay claims a certainty that grows with
/// every measurement, and is not there: such a parameter is kept, and the others are found again beside it. So is one that
/// came to the end of what is allowed, which is no number to go by; and, where something is held out, less noise of own
/// sensors that the position rests on for longer than any stretch that is held out. Constants of errors that stay are found in
/// each scenario by itself and, where something is held out, tried on that; of own sensors those that gain nothing over such
/// stretches are not judged where the position goes without a fix for longer. Throws Error on scenarios whose sensors
/// differ, names that are not there, parameters without data, fewer data than parameters, and as the builders of problems
/// and calibrate() do.
ScenarioCalibration calibrate_scenarios(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options);

}  // namespace tandem
