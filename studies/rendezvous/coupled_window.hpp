#pragma once

#include <optional>
#include <vector>

#include <tandem/problem/planning/plan_problem.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// Sliding window of odometry and target measurements, and the estimation problem that a coupled plan extends.
class CoupledWindow {
 public:
  /// `sensors`: sensors and noise; odometry and measurements in it are ignored. `seconds`: length of the window.
  CoupledWindow(const TrackingData& sensors, const TrackingOptions& options, double seconds);

  /// Adds an odometry pose. Poses must be in time order.
  void add_odometry(const Stamped<SE3>& pose) { data_.odometry.push_back(pose); }
  /// Adds a measurement of the target sensor with this index.
  void add(std::size_t sensor, const Measurement& m) { data_.sensors[sensor].measurements.push_back(m); }

  /// Solves the problem of the window, warm-started from the previous solution, and returns it for a coupled plan from
  /// the newest odometry pose. The returned problem is valid until the next call. Returns nullopt if the window has too
  /// little data or the solve does not converge.
  std::optional<CoupledEstimate> estimate();

 private:
  struct PreviousState {
    double t;
    SE3 chaser, target;
  };
  void drop_old_data();
  void warm_start();

  TrackingData data_;
  TrackingOptions options_;
  double seconds_;
  std::optional<TrackingProblem> tracking_;
  std::vector<PreviousState> previous_;
};

}  // namespace tandem
