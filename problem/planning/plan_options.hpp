#pragma once

#include <optional>
#include <string>

#include <tandem/lie/se3.hpp>
#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/vehicle/visibility.hpp>

namespace tandem {

/// Cone constraint. One body carries the apex and the axis, the x axis of the apex frame. A point of the other body
/// must stay inside.
struct Cone {
  double half_angle;                    ///< [rad], above 0 and below π/2
  SE3 apex{};                           ///< pose in the frame of the body that carries the apex
  Vector<3> point = Vector<3>::Zero();  ///< position in the frame of the other body [m]
};

/// Goals and constraints of a plan. Costs are specified by standard deviations, like measurements: a deviation of one
/// standard deviation costs ½.
struct PlanOptions {
  int steps = 50;   ///< number of steps H
  double dt = 1.0;  ///< duration of a step [s]

  SE3 goal{};                        ///< Desired pose of the chaser in the frame of the target.
  double running_position = 10;      ///< σ of the distance to the goal at each step [m].
  double running_orientation = 1.0;  ///< σ of the rotation to the goal at each step [rad].
  double terminal_position = 1.0, terminal_orientation = 0.2;  ///< Both σ at the last step [m, rad].
  double running_speed = 1.0, running_turn_rate = 0.3;         ///< Velocity relative to the target: σ [m/s, rad/s].
  double effort = 1.0;                                         ///< σ of the commands, in units of half their range.
  double rate = 0.5;  ///< σ of their change per step, in units of half their range.

  /// Cost per nat of the expected loss of information from fixes at each step, or of an upper bound on it (see
  /// Visibility). It makes the chaser keep the target in sight. 0 disables it.
  double information = 0.0;
  FieldOfView sight{};  ///< range and field of view of the sensor
  Vector<6> fix = (Vector<6>() << 0.05, 0.05, 0.05, 0.03, 0.03, 0.03).finished();  ///< σ of a fix [m, rad]

  // Hard constraints.
  std::optional<Bounds<6>> twist{};           ///< Body twist over ground [m/s, rad/s].
  std::optional<double> lowest{}, highest{};  ///< Height z in the world [m]; `lowest` is minus the maximum depth.
  std::optional<double> max_roll_pitch{};     ///< Magnitude of roll and of pitch [rad], below π/2.
  double keep_out = 0.0;                      ///< Minimum distance of the origins of the two bodies [m]; 0 for docking.
  std::optional<Cone> approach{};             ///< Carried by the target; the chaser stays inside.
  std::optional<Cone> view{};                 ///< Carried by the chaser; the target stays inside.
  /// Number of standard deviations by which keep-out and cones are tightened, from the predicted covariance of the
  /// target. With 2, each constraint holds at each step with a probability of 98 %, if it is nearly linear. 0
  /// constrains the mean only.
  double chance = 0.0;
};

/// Returns the weight of a coupled plan's costs (CoupledEstimate::cost_weight) for the covariance of the target's pose
/// at the end of the plan (right perturbations [m, rad]). With this weight, the information of the terminal goal about
/// the target is at most 1e-4 of the information of the estimate.
double coupled_cost_weight(const PlanOptions& options, const Matrix<6, 6>& covariance_at_end);

/// Returns the information gain of one fix for a target pose of this covariance: ½ log det(I + Σ R⁻¹) [nat].
double information_of_fix(const PlanOptions& options, const Matrix<6, 6>& covariance);
/// Returns the expected information of a fix at these poses, P R⁻¹ [1/m², 1/rad²], with the detection probability P.
Matrix<6, 6> expected_information(const PlanOptions& options, const SE3& chaser, const SE3& target);

/// Returns an empty string, or the reason why no plan can satisfy the options. Checks the range of each option, crossed
/// bounds, and whether the goal violates keep-out, approach or view. Names the conflicting constraints.
std::string why_invalid(const PlanOptions& options);

}  // namespace tandem
