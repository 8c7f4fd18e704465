#pragma once

#include <string>
#include <vector>

#include <tandem/problem/planning/discretisation_error.hpp>
#include <tandem/problem/planning/expected_fixes.hpp>
#include <tandem/solvers/replanning/conflicting_limits.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// State of chaser and target at the instant of a recording from which a plan starts.
struct PlanStart {
  double t;  ///< time of the newest keyframe [s]
  SE3 chaser;
  Vector<6> chaser_twist;  ///< mean over the last second of odometry, body axes [m/s, rad/s]
  /// The last target poses and their covariance relative to the chaser's current pose. Common drift of both vehicles
  /// does not affect a plan, so the chaser's pose counts as exact.
  TargetBelief target;
  Vector<6> target_noise;                          ///< σ of the target's motion model, per √s [m, rad]
  std::optional<Vector<6>> target_time_constants;  ///< time constants of a damped twist [s]
  std::vector<ExpectedSensor> sensors;  ///< position and pose sensors at their rates of the last minute; `sight` unset
  Summary summary;                      ///< result of the estimate
};

/// Input of plan_scenario(), in ENU-FLU.
struct PlanRequest {
  double at = 0.0;  ///< time at which the plan starts [s]
  PlanOptions plan{};
  PlannerOptions planner{};
  bool coupled = false;                   ///< solve estimate and plan in one nonlinear program (CoupledEstimate)
  Vector<3> current = Vector<3>::Zero();  ///< water current along the world's axes [m/s]
};

/// One instant of a plan.
struct PlannedInstant {
  double t;
  SE3 chaser;
  Vector<6> twist;                     ///< twist of the chaser, body axes [m/s, rad/s]
  Eigen::VectorXd actuators, command;  ///< one entry per actuator; `command` is empty at the last instant
  SE3 target;
  Matrix<6, 6> target_covariance;  ///< relative to the chaser at the start, right perturbations
  Matrix<6, 6>
      target_covariance_with_fixes;  ///< target_covariance reduced by the fixes that are expected along the plan
};

/// A plan with its inputs and the result of the solve.
struct PlannedRun {
  std::string scenario;
  Frame frame;  ///< frame of written results; all members are in ENU-FLU
  Vehicle vehicle;
  PlanRequest request;
  PlanStart start;
  Summary summary;
  PlanOrigin origin;
  bool coupled;
  double max_violation;
  std::string worst_constraint;
  std::vector<PlannedInstant> instants;
  DiscretisationError discretisation;  ///< error by the steps of the plan
  std::vector<ActiveConstraint> active;
  std::vector<PlanLimit> conflict;  ///< contradicting limits; empty if a plan was found or the time limit was reached

  bool accepted() const { return tandem::accepted(origin, summary.status, max_violation); }
};

/// Estimates chaser and target from the measurements up to `request.at` and plans the chaser's motion from there.
/// Needs a target pose at every keyframe: no planar scenario, no Mode B, no model without orientation.
/// Throws Error if this does not hold, if there are no two odometry poses before `request.at`, if the estimate does not
/// converge, or if vehicle and options admit no plan.
PlannedRun plan_scenario(const Scenario& scenario, const TrackingOptions& tracking, const Vehicle& vehicle,
                         const PlanRequest& request);

/// Difference between the last instant of a plan and its goal.
struct MissAtEnd {
  double position;     ///< m
  double orientation;  ///< rad
  double speed;        ///< speed of the chaser relative to the moving goal [m/s]
};
MissAtEnd miss_at_end(const PlannedRun& run);

}  // namespace tandem
