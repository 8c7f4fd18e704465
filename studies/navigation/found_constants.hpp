#pragma once

#include <cmath>
#include <string>
#include <vector>

#include <tandem/problem/navigation/sensor_constants.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {

/// What an estimate has found of a constant of a sensor (SensorConstant), or, online, of its bias.
struct FoundConstant {
  std::string name;      ///< "usbl.scale", "camera.misalignment.rx", "dvl.delay", "gps.bias.2": of its second row
  double value = 0;      ///< 1 (the sensor reads 1 + this), rad about an axis of the sensor, s, the row's unit
  double given = 0;      ///< the standard deviation before
  double deviation = 0;  ///< the standard deviation after; 0 where covariances are not known
  /// Whether the data tell it apart from the motion and the other errors. One that they do not stays where its prior has it.
  bool determined() const { return deviation < 0.9 * given; }
  /// Whether it is farther from none than two of the deviations before: a model that is wrong elsewhere may move it.
  bool at_odds() const { return std::abs(value) > 2 * given; }
  /// "usbl.scale 0.0213 ± 0.0012"
  std::string text() const;
};

/// At the problem's values; `marginals` of the same problem there, or null.
std::vector<FoundConstant> found_constants(const Problem& problem, const std::vector<SensorConstant>& constants,
                                           const Marginals* marginals);

/// Of an estimator's window: biases as they were measured with last.
std::vector<FoundConstant> found_errors(const std::vector<OnlineEstimator::SensorError>& errors);

/// A line each, and which of them the data do not tell; empty where there are none.
std::string constants_text(const std::vector<FoundConstant>& constants);

}  // namespace tandem
