#pragma once

#include <functional>
#include <string>
#include <vector>

#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// A number of a sensor that is no standard deviation, by the name that noise files and `--free` have for it: the time of
/// an error that is forgotten ("lidar.time", s), the degrees of freedom of a loss of Student's t ("usbl.dof").
struct SensorNumber {
  std::string name;
  double value = 0;                 ///< above zero; not where there is none
  std::string why_not;              ///< empty, or why there is none: what to give
  bool settable = true;             ///< whether it may be given nevertheless
  std::function<void(double)> set;  ///< of the scenario that it is of, which has to live and keep its sensors
};

/// Losses of all measurements that say none of their own, and what else tells how many rows a loss is over.
struct SensorLosses {
  Loss target{}, own{};
  bool orientation_apart = false;  ///< poses' orientations have a loss of their own
  /// Poses' positions are said twice (TrackingOptions::position_share), or alone, where the target is a point.
  bool by_parts = false;
};

/// Of all sensors of a scenario, the target's and the chaser's own.
std::vector<SensorNumber> sensor_numbers(Scenario& scenario, const SensorLosses& losses);

}  // namespace tandem
