#pragma once

#include <string>
#include <vector>

#include <tandem/problem/planning/expected_fixes.hpp>
#include <tandem/solvers/planning/clashing_limits.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// A chaser and its target at one instant of a recording: where a plan starts.
struct RendezvousStart {
  double t;  ///< s, of the newest keyframe
  SE3 chaser;
  Vector<6> chaser_twist;  ///< body axes, mean over the last second of odometry [m/s, rad/s]
  /// The target's last poses and their covariance as seen from the chaser now, which counts as exact: a plan is about
  /// how the two move relative to each other, and what they drift together does not matter.
  TargetBelief target;
  Vector<6> target_noise;                ///< of its motion, per √s [m, rad]
  std::optional<Vector<6>> target_time;  ///< s, of a twist that is forgotten
  std::vector<ExpectedSensor> sensors;   ///< of positions and poses, as often as in the last minute; no sight yet
  Summary summary;                       ///< of the estimate
};

struct PlanRequest {
  double at = 0.0;  ///< s
  PlanOptions plan{};
  PlannerOptions planner{};
  bool coupled = false;                   ///< what was measured, and the plan, in one program: CoupledEstimate
  Vector<3> current = Vector<3>::Zero();  ///< of the water, along the world's axes [m/s]
};

/// One instant of a plan.
struct PlannedInstant {
  double t;
  SE3 chaser;
  Vector<6> twist;                     ///< of the chaser, body axes [m/s, rad/s]
  Eigen::VectorXd actuators, command;  ///< one each an actuator; no command at the end
  SE3 target;
  Matrix<6, 6> target_covariance;  ///< as seen from the chaser at the start, right perturbations
  Matrix<6, 6> with_fixes;         ///< the same with what the plan is expected to see of it
};

/// What a plan is, and how it came about.
struct PlannedRun {
  std::string scenario;
  Frame frame;  ///< what results are written in; everything here is in ENU-FLU
  Vehicle vehicle;
  PlanRequest request;
  RendezvousStart start;
  Summary summary;
  PlanOrigin origin;
  bool coupled;
  double max_violation;
  std::string worst_constraint;
  std::vector<PlannedInstant> instants;
  std::vector<ActiveConstraint> active;
  std::vector<PlanLimit> clash;  ///< where no plan was found, though not for want of time

  bool accepted() const { return tandem::accepted(origin, summary.status, max_violation); }
};

/// Pursuit, and the start of first plans, within what the vehicle can do.
void pursue_within(PlannerOptions& planner, const Vehicle& vehicle);

/// Estimates chaser and target out of what was measured until `request.at`, and plans the chaser's motion from there on.
/// Throws Error where the recording has not begun by then, the target is not a pose at every keyframe (planar, Mode B, or
/// models without orientation), the estimate does not converge, or the vehicle or the options make no plan.
PlannedRun plan_scenario(const Scenario& scenario, const TrackingOptions& tracking, const Vehicle& vehicle,
                         const PlanRequest& request);

/// The plan's last instant against the goal.
struct MissAtEnd {
  double position;     ///< m
  double orientation;  ///< rad
  double speed;        ///< of the chaser against what goes along with the target [m/s]
};
MissAtEnd miss_at_end(const PlannedRun& run);

}  // namespace tandem
