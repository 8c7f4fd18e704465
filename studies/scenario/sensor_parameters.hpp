#pragma once

#include <functional>
#include <string>
#include <vector>

#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// A scalar parameter of a sensor other than a standard deviation, with its name in noise files and in `--free`.
/// Examples: the correlation time of a bias [s] ("lidar.time"), and the degrees of freedom of a Student's t loss
/// ("usbl.dof").
struct SensorParameter {
  std::string name;
  double value = 0;                 ///< Positive; 0 if the sensor does not have the parameter.
  std::string why_not;              ///< Why the sensor does not have it, with the remedy; empty if it has it.
  bool settable = true;             ///< Whether set() may be called, even if the sensor does not have it yet.
  std::function<void(double)> set;  ///< Sets it; valid while the scenario exists and its sensors do not change.
};

/// The default losses of a problem, and the properties that determine how many rows a loss applies to.
struct SensorLosses {
  Loss target{}, own{};
  bool separate_orientation = false;  ///< measured orientations have a separate loss
  /// Whether a pose measurement has a separate residual for its position (TrackingOptions::position_share). If the
  /// target is a point, this is its only residual.
  bool split_poses = false;
};

/// Returns the parameters of all sensors of a scenario, those of the target first.
std::vector<SensorParameter> sensor_parameters(Scenario& scenario, const SensorLosses& losses);

}  // namespace tandem
