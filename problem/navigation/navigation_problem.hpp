#pragma once

#include <vector>

#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/problem/stop.hpp>

namespace tandem {

/// Maximum-a-posteriori problem of a chaser that navigates with its own sensors.
struct NavigationProblem {
  Problem problem;
  std::vector<EgoKeyframe> keyframes;
  std::vector<PlacedEgoMeasurement> measurements;
  /// Number of measurements of each sensor that cannot be attached to a keyframe (EgoChain::can_attach).
  std::vector<std::size_t> num_discarded;
  std::optional<Variable<Rn<1>>> dvl_scale;       ///< scale factor error, if EgoOptions::dvl_scale is set
  std::vector<SensorConstant> constants;          ///< constant systematic errors of the sensors
  std::vector<std::pair<double, double>> splits;  ///< EgoChain::splits()

  /// Returns the state at keyframe k, from the current values of the variables.
  EgoState state(std::size_t k) const;
};

/// Builds the problem with keyframes at the times of `guess`, which are at least two and increase. The states of
/// `guess` are the initial guess, and their biases linearise the IMU preintegration. `start` gives the prior of the
/// first state. Throws Error if the data are inconsistent, and Stopped if `stop` requests it.
NavigationProblem make_navigation_problem(const NavigationData& data, const std::vector<Stamped<EgoState>>& guess,
                                          const Alignment& start, const EgoOptions& options = {},
                                          const Stop& stop = {});

/// A measurement in the data, with its time of validity.
struct EgoEvent {
  double t;                   ///< s
  std::size_t sensor, index;  ///< indices in NavigationData::sensors and EgoSensor::measurements
};
/// Returns the measurements of all sensors, sorted by time of validity.
std::vector<EgoEvent> in_time_order(const std::vector<EgoSensor>& sensors);

}  // namespace tandem
