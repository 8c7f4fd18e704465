#pragma once

#include <optional>
#include <vector>

#include <tandem/problem/planning/plan_problem.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// The last seconds of odometry and of measurements of a target, and the problem that they make: what a coupled plan joins.
class CoupledWindow {
 public:
  /// `sensors`: sensors and noise; their measurements are not read. `seconds`: how long it remembers.
  CoupledWindow(const TrackingData& sensors, const TrackingOptions& options, double seconds);

  /// In the order of time.
  void add_odometry(const Stamped<SE3>& pose) { data_.odometry.push_back(pose); }
  void add(std::size_t sensor, const Measurement& m) { data_.sensors[sensor].measurements.push_back(m); }

  /// What a plan from the newest odometry on joins: the window's problem, solved, from where the last one ended. It lives
  /// until the next call. Nothing where the window makes no problem yet, or its solve does not converge.
  std::optional<CoupledEstimate> estimate();

 private:
  struct Known {
    double t;
    SE3 chaser, target;
  };
  void forget();
  void start_from_last();

  TrackingData data_;
  TrackingOptions options_;
  double seconds_;
  std::optional<TrackingProblem> tracking_;
  std::vector<Known> last_;
};

}  // namespace tandem
