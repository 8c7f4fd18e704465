#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/planning_options.hpp>
#include <tandem/studies/rendezvous/rendezvous.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr int kMaxSteps = 2000;

Vector<3> parse_xyz(const std::string& option, const std::string& text) {
  const std::vector<double> v = parse_numbers(option, text);
  if (v.size() != 3 || !std::isfinite(v[0] + v[1] + v[2]))
    throw Error(fmt::format("{} takes three numbers, X,Y,Z, not {}", option, quote(text)));
  return {v[0], v[1], v[2]};
}

double parse_half_angle(const std::string& option, const std::string& text) {
  const double degrees = parse_positive(option, text);
  if (degrees >= 90.0) throw Error(fmt::format("{} must be below 90 degrees, not {:g}", option, degrees));
  return kRadians * degrees;
}

PlanSolver parse_plan_solver(const std::string& option, const std::string& text) {
  std::vector<std::string> names;
  for (const PlanSolver solver : {PlanSolver::augmented_lagrangian, PlanSolver::ipopt, PlanSolver::slsqp}) {
    if (name(solver) == text) return solver;
    names.emplace_back(name(solver));
  }
  throw Error(
      fmt::format("{} takes {}, not {}{}", option, listed(names, "or"), quote(text), did_you_mean(text, names)));
}

}  // namespace

void add_planning_options(CommandOptions& option, PlanningArguments& r) {
  PlanOptions& plan = r.plan;
  option("--vehicle", "NAME|FILE", "Chaser: remus_100 (default), bluerov2_heavy or a YAML file", r.vehicle,
         [](const std::string&, const std::string& text) { return text; });
  option("--horizon", "S", "Planning horizon [s] (default 50)", r.horizon, parse_positive);
  option("--step", "S", "Time step [s] (default 1)", plan.dt, parse_positive);
  option("--goal", "X,Y,Z", "Goal position of the chaser in the target's body frame [m] (default -6,0,0)", r.goal,
         parse_xyz);
  option.set(
      "--goal-yaw", "DEG", "Goal heading of the chaser relative to the target's (default 0)",
      [&r](const std::string& name, const std::string& text) { r.goal_yaw = kRadians * parse_finite(name, text); });
  option("--keep-out", "M", "Minimum distance between chaser and target (default 0: docking)", plan.keep_out,
         parse_non_negative);
  option("--depth", "MIN,MAX", "Bounds on the chaser's depth [m]", r.depth, parse_interval);
  option("--current", "X,Y,Z", "Water current along the world's axes [m/s] (default 0,0,0)", r.current, parse_xyz);
  option.flag("--coupled", "Solve estimate and plan as one nonlinear program", r.coupled);
  option.advanced();
  option("--approach", "DEG", "Keep the chaser in a cone from the target towards the goal; half angle", r.approach,
         parse_half_angle);
  option("--view", "DEG", "Keep the target in the chaser's forward field of view; half angle", r.view,
         parse_half_angle);
  add_chance_option(option, plan.chance);
  option("--information", "WEIGHT", "Cost per nat of expected information about the target that is missed (default 0)",
         plan.information, parse_non_negative);
  option.set("--sight", "M,DEG", "Range and half angle of view of the chaser's camera (default 9,45)",
             [&plan](const std::string& name, const std::string& text) {
               const std::vector<double> v = parse_numbers(name, text);
               if (v.size() != 2 || !(v[0] > 0 && v[1] > 0 && v[1] < 180) || !std::isfinite(v[0]))
                 throw Error(fmt::format("{} takes a range and a half angle below 180 degrees, M,DEG, not {}", name,
                                         quote(text)));
               plan.sight.range = v[0];
               plan.sight.half_angle = kRadians * v[1];
             });
  option.set(
      "--most-roll-pitch", "DEG", "Bound on the magnitude of the chaser's roll and pitch",
      [&r](const std::string& name, const std::string& text) { r.plan.max_roll_pitch = parse_half_angle(name, text); });
  option.group("Solver");
  add_plan_solver_options(option, r.planner);
}

void add_chance_option(CommandOptions& option, double& sigmas) {
  option("--chance", "SIGMAS", "Margin of keep-out and cones, in σ of the predicted target (default 0)", sigmas,
         parse_non_negative);
}

void add_plan_solver_options(CommandOptions& option, PlannerOptions& planner) {
  option("--solver", "NAME", "ipopt (default), augmented-lagrangian, or nlopt:slsqp for short horizons", planner.solver,
         parse_plan_solver);
  option.set("--deadline", "MS", "Time limit per plan; the best feasible iterate is then used",
             [&planner](const std::string& name, const std::string& text) {
               planner.deadline = 1e-3 * parse_positive(name, text);
             });
}

PlanRequest plan_request(const PlanningArguments& r, const Vehicle& vehicle, const Frame& frame) {
  PlanRequest request;
  request.plan = r.plan;
  request.planner = r.planner;
  request.coupled = r.coupled;
  PlanOptions& plan = request.plan;
  const double steps = std::round(r.horizon / plan.dt);
  if (!(steps >= 1.0 && steps <= kMaxSteps))
    throw Error(fmt::format("--horizon {:g} s in steps of {:g} s gives {:g} steps; give 1 to {}", r.horizon, plan.dt,
                            steps, kMaxSteps));
  plan.steps = static_cast<int>(steps);
  plan.goal = frame.body(SE3(SO3::Exp({0.0, 0.0, r.goal_yaw}), r.goal));
  plan.twist = Bounds<6>{-vehicle.most_twist, vehicle.most_twist};
  request.current = frame.world(r.current);
  if (r.approach) {
    const Vector<3> axis = plan.goal.translation();
    if (!(axis.norm() > 0)) throw Error("--approach needs a --goal away from the target: the cone opens towards it");
    const double yaw = std::atan2(axis.y(), axis.x()), pitch = std::atan2(-axis.z(), std::hypot(axis.x(), axis.y()));
    const SO3 along = SO3::Exp({0.0, 0.0, yaw}) * SO3::Exp({0.0, pitch, 0.0});
    plan.approach = Cone{*r.approach, SE3(along, Vector<3>(Vector<3>::Zero()))};
  }
  if (r.view) plan.view = Cone{*r.view};
  if (r.depth) {
    plan.highest = -r.depth->lower[0];
    plan.lowest = -r.depth->upper[0];
  }
  if (const std::string why = why_invalid(plan); !why.empty()) throw Error(why);
  request.planner.pursuit = pursuit_limits(vehicle);
  return request;
}

}  // namespace tandem
