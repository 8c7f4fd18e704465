#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/problem/navigation/sensor_constants.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {

/// What to make of a constant.
enum class ConstantVerdict {
  unknown,  ///< it has no standard error
  found,
  predicts_better,     ///< found, and held-out measurements are predicted better with it than without
  predicts_no_better,  ///< found, and they are not
  untold,              ///< the data tell less of it, apart from the motion and the other errors, than its prior does
  at_odds,  ///< farther from none than two of the deviations before: a model that is wrong elsewhere may move it
  at_odds_yet_better,  ///< so far, and held-out measurements are predicted better with it
};
/// The words of every table, text and file.
std::string_view text(ConstantVerdict verdict);

/// What an estimate has found of a constant of a sensor (SensorConstant), or, online, of its bias.
struct FoundConstant {
  std::string name;      ///< "usbl.scale", "camera.misalignment.rx", "dvl.delay", "gps.bias.2": of its second row
  double value = 0;      ///< 1 (the sensor reads 1 + this), rad about an axis of the sensor, s, the row's unit
  double given = 0;      ///< the standard deviation before
  double deviation = 0;  ///< the standard deviation after; 0 where covariances are not known
  /// By how much the log likelihood of held-out measurements is greater with it than without, and the standard error of that;
  /// where they were asked.
  struct HeldOut {
    double gain, error;
  };
  std::optional<HeldOut> held_out{};

  ConstantVerdict verdict() const;
  /// "usbl.scale 0.0213 ± 0.0012"
  std::string text() const;
};

/// At the problem's values; `marginals` of the same problem there, or null.
std::vector<FoundConstant> found_constants(const Problem& problem, const std::vector<SensorConstant>& constants,
                                           const Marginals* marginals);

/// The same of a tracking problem that is solved: how well delays are told is by evidence_deviation(), at most as given;
/// not known where that is not.
std::vector<FoundConstant> found_constants_by_evidence(const Problem& problem,
                                                       const std::vector<SensorConstant>& constants,
                                                       const Marginals& marginals, const Stop& stop);

/// Of an estimator's window: biases as they were measured with last.
std::vector<FoundConstant> found_errors(const std::vector<OnlineEstimator::SensorError>& errors);

/// A line each, with its verdict, and what to do; empty where there are none.
std::string constants_text(const std::vector<FoundConstant>& constants);
/// What to do about verdicts that ask for it: sentences, or nothing.
std::string constants_advice(const std::vector<ConstantVerdict>& verdicts);

}  // namespace tandem
