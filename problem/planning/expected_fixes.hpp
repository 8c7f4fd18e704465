#pragma once

#include <optional>
#include <vector>

#include <tandem/residuals/vehicle/unseen.hpp>
#include <tandem/residuals/vehicle/vehicle_step.hpp>

namespace tandem {

/// A sensor of the chaser whose fixes of the target are still to come.
struct ExpectedSensor {
  double rate;         ///< fixes a second while it sees the target [1/s]
  Vector<3> position;  ///< σ of a fix along the chaser's axes; along the target's if it measures the rotation, too [m]
  std::optional<Vector<3>> rotation{};  ///< σ [rad]; none: of the position alone
  std::optional<Sight> sight{};         ///< none: it hears the target all around
};

/// What fixes along a plan are expected to tell of the target's pose [1/m², 1/rad²], by right perturbations, for
/// predict_target: Σ P rate dt R⁻¹ over the sensors, after each step where the two then are, P as in Unseen. The prediction's
/// covariance is then that of a Kalman filter along the plan: Σ⁻¹ ← (F Σ Fᵀ + Q)⁻¹ + Σ P rate dt R⁻¹. It counts a fix of
/// probability P as that share of its information, which is somewhat less covariance than the mean over what may come
/// (the inverse is convex). `chaser` and `target` are now and after each step, of equal length: throws Error else.
std::vector<Matrix<6, 6>> expected_fixes(const std::vector<ExpectedSensor>& sensors, double dt,
                                         const std::vector<SE3>& chaser, const std::vector<SE3>& target);

/// The same along a vehicle's states.
template <int N>
std::vector<Matrix<6, 6>> expected_fixes(const std::vector<ExpectedSensor>& sensors, double dt,
                                         const std::vector<VehicleState<N>>& chaser, const std::vector<SE3>& target) {
  std::vector<SE3> poses;
  for (const VehicleState<N>& state : chaser) poses.push_back(state.pose);
  return expected_fixes(sensors, dt, poses, target);
}

}  // namespace tandem
