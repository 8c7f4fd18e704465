#pragma once

#include <optional>
#include <string>

#include <tandem/lie/se3.hpp>
#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/vehicle/unseen.hpp>

namespace tandem {

/// A cone that something has to stay in: apex and axis (x of its frame) on one body, the point on the other.
struct Cone {
  double half_angle;                    ///< rad, above 0 and below π/2
  SE3 apex{};                           ///< in the body that carries it
  Vector<3> point = Vector<3>::Zero();  ///< m, in the other body
};

/// What a plan is to reach and to keep to. Costs are by standard deviations, as those of measurements are: what one of
/// them costs is ½.
struct PlanOptions {
  int steps = 50;   ///< H
  double dt = 1.0;  ///< s a step

  SE3 goal{};                                                  ///< wanted pose of the chaser in the target's frame
  double running_position = 10;                                ///< m from the goal, at each step
  double running_orientation = 1.0;                            ///< rad
  double terminal_position = 1.0, terminal_orientation = 0.2;  ///< at the last step
  double running_speed = 1.0, running_turn_rate = 0.3;         ///< m/s and rad/s from the target's motion, at each step
  double effort = 1.0;                                         ///< commands, as a share of half their range
  double rate = 0.5;                                           ///< their change from step to step, likewise

  /// Seeing as a goal: what is expected to be missed of a fix's information at a step, bounded from above (Unseen), costs
  /// as much a nat. 0: no goal.
  double information = 0.0;
  Sight sight{};                                                                   ///< of what gives the fixes
  Vector<6> fix = (Vector<6>() << 0.05, 0.05, 0.05, 0.03, 0.03, 0.03).finished();  ///< their σ [m, rad]

  // Hard:
  std::optional<Bounds<6>> twist{};           ///< over the ground, body axes [m/s, rad/s]
  std::optional<double> lowest{}, highest{};  ///< height z in the world [m]: lowest is minus the greatest depth
  std::optional<double> most_roll_pitch{};    ///< magnitude of each [rad], below π/2
  double keep_out = 0.0;                      ///< least distance of the two bodies' origins [m]; 0: docking, none
  std::optional<Cone> approach{};             ///< from the target, that the chaser stays in
  std::optional<Cone> view{};                 ///< from the chaser, that the target's lights stay in
  /// Keep-out and the cones hold by this many standard deviations of what they measure, by the target's predicted
  /// covariance: at 2, with a chance of 98 % each at each step where they are nearly linear over it. 0: on the mean.
  double chance = 0.0;
};

/// What a coupled plan's costs may count for (CoupledEstimate::share) where the target's pose at the plan's end has this
/// covariance (right perturbations [m, rad]): so little that the terminal goal pulls at the prediction with a ten-thousandth
/// of what holds it.
double coupled_share(const PlanOptions& options, const Matrix<6, 6>& covariance_at_end);

/// What a fix would tell of a target's pose that has this covariance [nats]: ½ log det(1 + Σ R⁻¹).
double information_of_fix(const PlanOptions& options, const Matrix<6, 6>& covariance);
/// The information [1/m², 1/rad²] that fixes are expected to bring with the two where they are: P R⁻¹.
Matrix<6, 6> expected_information(const PlanOptions& options, const SE3& chaser, const SE3& target);

/// Empty, or a sentence that says what no plan can do with these: a number out of its range, bounds that cross, a goal
/// that keep-out, approach or view forbid. The constraints that clash are named.
std::string why_impossible(const PlanOptions& options);

}  // namespace tandem
