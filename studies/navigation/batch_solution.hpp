#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tandem/studies/navigation/gross_errors.hpp>
#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// A solution of the batch problem for one judgement about the IMU, with the data that it rejects.
///
/// If the IMU contradicts another sensor, either may be wrong. Without the IMU, a single other sensor always agrees with
/// itself. navigate() therefore solves both ways and compares.
class BatchSolution {
 public:
  enum class Imu {
    excludable,  ///< The online first pass excludes the IMU while it contradicts the other sensors.
    trusted,     ///< Measurements outside the gate of the online first pass are rejected instead.
  };
  using Intervals = std::vector<std::pair<double, double>>;  // start and end [s]

  /// Computes the initial guess by fixed-lag smoothing. `data` must outlive this.
  BatchSolution(const NavigationData& data, Imu imu, const Alignment& start, const NavigationOptions& options,
                const Stop& stop);
  BatchSolution(const BatchSolution&) = delete;

  /// Solves the batch problem until the preintegration is valid and the gross errors stay the same. `trial`:
  /// stops after a solve that does not converge.
  void solve(const NavigationOptions& options, const Stop& stop, bool trial = false);

  std::vector<Stamped<EgoState>> states;
  NavigationData placed;  ///< the data in use, with the delays of the last solve; their weak priors move along
  std::optional<NavigationProblem> built;
  GrossErrors errors;
  Intervals without_imu;  ///< intervals in which the first pass excludes the IMU
  Summary summary;
  int solves = 0;

 private:
  Alignment start_;
};

/// Returns the delay of a sensor in a solved problem, relative to EgoSensor::delay [s].
double estimated_delay(const NavigationProblem& built, const EgoSensor& sensor);

/// Returns whether the solution that trusts the IMU explains the data better than the one that excludes it. A solution
/// with an impossible speed loses. The IMU loses if more sensors would be wrong with it than without it. Otherwise, the
/// solution with the lower cost wins, to which each rejected row adds the surprise of a gross error.
bool explains_better(const BatchSolution& trusting, const BatchSolution& excluding);

}  // namespace tandem
