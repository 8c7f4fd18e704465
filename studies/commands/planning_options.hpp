#pragma once

#include <string>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/planning/plan_scenario.hpp>

namespace tandem {

/// Arguments of `tandem plan`. Vectors are along the axes of the scenario's files.
struct PlanningArguments {
  std::string vehicle = "remus_100";
  double horizon = 50.0;  ///< s
  PlanOptions plan{};
  PlannerOptions planner{};
  Vector<3> goal{-6.0, 0.0, 0.0};  ///< m, in the target's body frame
  bool coupled = false;
  double goal_yaw = 0.0;  ///< rad, relative to the target's yaw
  Vector<3> current = Vector<3>::Zero();
  std::optional<double> approach, view;  ///< half angles [rad]
  std::optional<Bounds<1>> depth;        ///< m below the surface
};
/// Adds all options of PlanningArguments to the command.
void add_planning_options(CommandOptions& option, PlanningArguments& request);
/// Adds --chance.
void add_chance_option(CommandOptions& option, double& sigmas);
/// Adds --solver and --deadline.
void add_plan_solver_options(CommandOptions& option, PlannerOptions& planner);

/// Converts the arguments to ENU-FLU and adds the limits of the vehicle. Throws Error that names the option if no plan
/// is possible.
PlanRequest plan_request(const PlanningArguments& request, const Vehicle& vehicle, const Frame& frame);

}  // namespace tandem
