#pragma once

#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_problem.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// One component of a sensor's residual, in the axes of the files.
struct Component {
  std::string name;  ///< "x", "rx", "range", …
  bool angle = false;
};
using Components = std::vector<Component>;

Components point_components(bool planar);
Components rotation_components(bool planar);
Components pose_components(bool planar);
/// Returns the components of a target sensor's residual.
Components sensor_components(SensorType type, bool planar);
/// Returns the components of the residual of one of the chaser's own sensors.
Components ego_components(const EgoSensor& sensor);

/// Returns the names of the components of one of the chaser's own sensors. If `north_east` is true, the files give world
/// positions as north, east, down.
std::vector<std::string> component_names(const EgoSensor& sensor, bool north_east);
/// Returns the names of the components of a target sensor.
std::vector<std::string> component_names(const TargetSensor& sensor, bool planar);

/// The sensors of a problem and their residual blocks, for fit_report().
struct JudgedMeasurements {
  std::vector<JudgedSensor> sensors;
  std::vector<MeasurementBlock> blocks;
  std::vector<NoiseOfBlock> noises;  ///< motion of the target and odometry
};
/// Returns the target's sensors, then the chaser's own sensors if they are part of the problem.
JudgedMeasurements judged_measurements(const Scenario& scenario, const TrackingProblem& built);
/// Adds the chaser's own sensors. If `north_east` is true, the files give world positions as north, east, down.
void add_own_sensors(const NavigationData& data, const std::vector<PlacedEgoMeasurement>& placed, bool north_east,
                     JudgedMeasurements& judged);

}  // namespace tandem
