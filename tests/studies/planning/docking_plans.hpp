#pragma once

#include <string>

#include <tandem/solvers/ipopt.hpp>
#include <tandem/studies/planning/plan_scenario.hpp>

#include "paths.hpp"

namespace tandem::testing {

/// Returns the simulated docking with its world turned by `yaw` [rad], shifted by `offset` [m] and dated `later` [s].
inline Scenario docking(double yaw = 0.0, const Vector<3>& offset = Vector<3>::Zero(), double later = 0.0) {
  Scenario scenario = read_scenario(std::string(paths::source) + "/share/scenarios/docking_a");
  const SE3 world(SO3::Exp({0.0, 0.0, yaw}), offset);
  for (Stamped<SE3>& pose : scenario.data.odometry) pose = {pose.t + later, world * pose.value};
  for (TargetSensor& sensor : scenario.data.sensors)
    for (Measurement& measurement : sensor.measurements) measurement.t += later;
  return scenario;
}

inline Vehicle docking_vehicle(const std::string& name) {
  return read_vehicle(std::string(paths::source) + "/share/vehicles/" + name + ".yaml");
}

/// Returns a request at a time of the docking [s], with a goal behind the target and the limits of the vehicle.
inline PlanRequest plan_at(double at, const Vehicle& vehicle, const Vector<3>& goal, int steps) {
  PlanRequest request;
  request.at = at;
  request.plan.steps = steps;
  request.plan.goal = SE3(SO3(), goal);
  request.plan.twist = Bounds<6>{-vehicle.most_twist, vehicle.most_twist};
  if (!ipopt_available()) request.planner.solver = PlanSolver::augmented_lagrangian;
  request.planner.pursuit = pursuit_limits(vehicle);
  return request;
}

}  // namespace tandem::testing
