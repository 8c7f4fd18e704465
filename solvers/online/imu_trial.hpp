#pragma once

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem::detail {

/// Decides between an IMU and the sensors that contradict the estimate. The IMU propagates all predictions, so a fault
/// of the IMU lets the gate reject every other sensor. A trial therefore estimates the last seconds again without the
/// IMU: if the other sensors agree with each other then, the IMU is wrong. The same trial with the IMU shows when it
/// works again.
class ImuTrial {
 public:
  /// The estimate of a trial in which all sensors agree.
  struct Agreement {
    Alignment newest;                       ///< last state of the trial
    std::vector<Stamped<EgoState>> states;  ///< states at all keyframes
  };

  /// `settings`: the sensors, without samples and measurements.
  ImuTrial(const NavigationData& settings, const OnlineOptions& options);

  // The newest data, in time order. Those that are older than 30 s are dropped.
  void add(const ImuSample& sample);
  void add(std::size_t sensor, const EgoMeasurement& m);
  const std::deque<ImuSample>& samples() const { return samples_; }

  /// Estimates the chaser from `start` to the newest measurement. Returns nothing if the gate rejects more than a tenth
  /// of the measurements of a sensor, or its last one.
  std::optional<Agreement> run(const Alignment& start, bool with_imu) const;

 private:
  NavigationData settings_;
  OnlineOptions options_;
  std::deque<ImuSample> samples_;
  std::deque<std::pair<std::size_t, EgoMeasurement>> measurements_;
};

}  // namespace tandem::detail
