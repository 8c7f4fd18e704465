#pragma once

#include <optional>
#include <string>

#include <tandem/studies/fit/likely_cause.hpp>
#include <tandem/studies/navigation/fit_delay.hpp>
#include <tandem/studies/navigation_results/navigation_metrics.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// A navigated scenario and its comparison with the truth.
struct NavigationStudy {
  Scenario scenario;  ///< with all its sensors
  EgoOptions options;
  Navigation navigation;
  NavigationComparison comparison;
  std::vector<DelayFit> delays;     ///< fitted delays
  std::vector<LikelyCause> causes;  ///< mistakes in the data that would explain misfits
  std::optional<double> after;      ///< adds a summary of the errors from this time after the first keyframe on [s]
};

/// Use of the data of one sensor.
struct EgoSensorOutcome {
  std::string name;
  std::string_view type;
  std::size_t lines = 0;  ///< number of lines after the checks
  double rate = 0;        ///< mean rate between its first and its last line [Hz]
  std::size_t used = 0, discarded = 0, down_weighted = 0;
};

/// Returns the outcome of the IMU, if there is one, then those of the other sensors.
std::vector<EgoSensorOutcome> ego_sensor_outcomes(const Navigation& navigation);

/// Returns a report for a terminal: solver summary, sensors, findings in the data, errors, GPS outages, biases.
std::string navigation_report(const NavigationStudy& study);

/// Returns the contents of summary.json, along the scenario's axes, without fields that are not available.
std::string navigation_json(const NavigationStudy& study);
/// Returns the keys of summary.json.
FileDescription navigation_json_keys();

}  // namespace tandem
