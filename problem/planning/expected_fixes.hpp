#pragma once

#include <optional>
#include <vector>

#include <tandem/residuals/vehicle/vehicle_step.hpp>
#include <tandem/residuals/vehicle/visibility.hpp>

namespace tandem {

/// Sensor of the chaser that is expected to measure the target during a plan.
struct ExpectedSensor {
  double rate;         ///< Fixes per second while the target is in sight [1/s].
  Vector<3> position;  ///< σ of a fix [m], along the axes of the chaser; of the target if `rotation` is set.
  std::optional<Vector<3>> rotation{};  ///< σ of the rotation [rad]; empty for position fixes.
  std::optional<FieldOfView> sight{};   ///< Field of view; empty for all directions.
};

/// Returns the information that fixes during a plan are expected to add to the target's pose after each step [1/m²,
/// 1/rad²], in right perturbations, for predict_target(). It is Σ P rate dt R⁻¹ over all sensors, with the detection
/// probability P (see Visibility) at the poses after the step.
///
/// The predicted covariance is that of a Kalman filter along the plan: Σ⁻¹ ← (F Σ Fᵀ + Q)⁻¹ + Σ P rate dt R⁻¹. It is
/// slightly smaller than the expected covariance, because a fix of probability P counts as a fraction of its
/// information and the inverse is convex.
///
/// `chaser` and `target` are the poses now and after each step. Throws Error if they are empty or differ in length.
std::vector<Matrix<6, 6>> expected_fixes(const std::vector<ExpectedSensor>& sensors, double dt,
                                         const std::vector<SE3>& chaser, const std::vector<SE3>& target);

/// Overload for the states of a vehicle.
template <int N>
std::vector<Matrix<6, 6>> expected_fixes(const std::vector<ExpectedSensor>& sensors, double dt,
                                         const std::vector<VehicleState<N>>& chaser, const std::vector<SE3>& target) {
  std::vector<SE3> poses;
  for (const VehicleState<N>& state : chaser) poses.push_back(state.pose);
  return expected_fixes(sensors, dt, poses, target);
}

}  // namespace tandem
