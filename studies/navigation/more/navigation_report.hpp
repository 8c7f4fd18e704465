#pragma once

#include <optional>
#include <string>

#include <tandem/studies/navigation/more/fit_delay.hpp>
#include <tandem/studies/navigation/more/navigation_metrics.hpp>

namespace tandem {

/// A scenario that was navigated, and how that compares with its truth.
struct NavigationStudy {
  Scenario scenario;  ///< with all its sensors
  EgoOptions options;
  Navigation navigation;
  NavigationComparison comparison;
  std::vector<DelayFit> delays;  ///< that were fitted
  std::optional<double> after;   ///< s after the first keyframe, from where on errors are summarised as well
};

/// What became of the data of one sensor.
struct EgoSensorOutcome {
  std::string name;
  std::string_view type;
  std::size_t lines = 0;  ///< after the checks
  double rate = 0;        ///< Hz, over its own time
  std::size_t used = 0, left_out = 0, down_weighted = 0;
};

/// The IMU, if there is one, then the others.
std::vector<EgoSensorOutcome> ego_sensor_outcomes(const Navigation& navigation);

/// For a terminal: what the data is and what was dropped of it, how the solve went, sensors, errors, times without GPS,
/// biases.
std::string navigation_report(const NavigationStudy& study);

/// summary.json: the same; a field that the truth or the sensors do not give is left out. Along the scenario's axes.
std::string navigation_json(const NavigationStudy& study);

}  // namespace tandem
