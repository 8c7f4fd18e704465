#pragma once

#include <vector>

#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/problem/stop.hpp>

namespace tandem {

/// The MAP problem of a chaser that navigates by its own sensors.
struct NavigationProblem {
  Problem problem;
  std::vector<EgoKeyframe> keyframes;
  std::vector<PlacedEgoMeasurement> measurements;
  std::vector<std::size_t> left_out;  ///< of each sensor: measurements before the first keyframe, or out of reach
  std::optional<Variable<Rn<1>>> dvl_scale;       ///< scale factor error, where EgoOptions asks for it
  std::vector<SensorConstant> constants;          ///< of the sensors that have some: scale, misalignment, delay, bias
  std::vector<std::pair<double, double>> splits;  ///< where keyframes are not tied by the IMU: from, to [s]

  EgoState state(std::size_t k) const;  ///< of keyframe k, at the variables' values
};

/// Keyframes at the times of `guess`, two or more and in time order, starting from its states; the samples in between are
/// summed up at its biases. `start`: what is known of the first of them beforehand. Throws Error when the data cannot
/// make a problem, and Stopped when it is to stop.
NavigationProblem make_navigation_problem(const NavigationData& data, const std::vector<Stamped<EgoState>>& guess,
                                          const Alignment& start, const EgoOptions& options = {},
                                          const Stop& stop = {});

/// Measurements of all sensors by the time when they were valid.
struct EgoEvent {
  double t;                   ///< s
  std::size_t sensor, index;  ///< in NavigationData::sensors, and in its measurements
};
std::vector<EgoEvent> in_time_order(const std::vector<EgoSensor>& sensors);

}  // namespace tandem
