#pragma once

#include <string>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/planning/plan_scenario.hpp>

namespace tandem {

/// What plan and rendezvous share. Vectors are along the axes of the scenario's files.
struct PlanningRequest {
  std::string vehicle = "remus_100";
  double horizon = 50.0;  ///< s
  PlanOptions plan{};
  PlannerOptions planner{};
  Vector<3> goal{-6.0, 0.0, 0.0};  ///< m, in the target's body
  bool coupled = false;
  double goal_yaw = 0.0;  ///< rad, against the target's
  Vector<3> current = Vector<3>::Zero();
  std::optional<double> approach, view;  ///< half angles [rad]
  std::optional<Bounds<1>> depth;        ///< m below the surface
};
void add_planning(CommandOptions& option, PlanningRequest& request);
/// --chance.
void add_chance(CommandOptions& option, double& sigmas);
/// --solver and --deadline.
void add_plan_solver(CommandOptions& option, PlannerOptions& planner);

/// The request in ENU-FLU, with the vehicle's own limits. Throws Error, naming the option, on what no plan can be made of.
PlanRequest plan_request(const PlanningRequest& request, const Vehicle& vehicle, const Frame& frame);

}  // namespace tandem
