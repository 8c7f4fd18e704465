#include <limits>

#include <tandem/solvers/replanning/conflicting_limits.hpp>

namespace tandem {
namespace {

constexpr double kWideRangeFactor = 100;  // range of commands if their limit is off, as a multiple of the given range
// Speed and turn rate of the pursuit without a twist limit, relative to the given ones.
constexpr double kFastPursuitFactor = 10;

bool is_asked(const PlanOptions& plan, PlanLimit limit) {
  switch (limit) {
    case PlanLimit::commands:
      break;
    case PlanLimit::twist:
      return plan.twist.has_value();
    case PlanLimit::depth:
      return plan.lowest || plan.highest;
    case PlanLimit::roll_pitch:
      return plan.max_roll_pitch.has_value();
    case PlanLimit::keep_out:
      return plan.keep_out > 0;
    case PlanLimit::approach:
      return plan.approach.has_value();
    case PlanLimit::view:
      return plan.view.has_value();
  }
  return true;
}

template <int N>
void remove_limit(PlanLimit limit, VehicleModel<N>& vehicle, PlanOptions& plan) {
  switch (limit) {
    case PlanLimit::commands: {
      const Vector<N> range = vehicle.upper - vehicle.lower;
      vehicle.lower -= kWideRangeFactor * range;
      vehicle.upper += kWideRangeFactor * range;
      return;
    }
    case PlanLimit::twist:
      return plan.twist.reset();
    case PlanLimit::depth:
      plan.lowest.reset();
      return plan.highest.reset();
    case PlanLimit::roll_pitch:
      return plan.max_roll_pitch.reset();
    case PlanLimit::keep_out:
      plan.keep_out = 0;
      return;
    case PlanLimit::approach:
      return plan.approach.reset();
    case PlanLimit::view:
      return plan.view.reset();
  }
}

/// Returns pursuit options for a plan without a twist limit: its initial guess reaches the goal in few steps.
PursuitOptions unlimited(PursuitOptions pursuit, double dt) {
  pursuit.speed *= kFastPursuitFactor;
  pursuit.turn_rate *= kFastPursuitFactor;
  pursuit.orientation_gain = pursuit.position_gain = 1.0 / dt;
  pursuit.response = 0.5 * dt;
  return pursuit;
}

}  // namespace

template <int N>
std::vector<PlanLimit> conflicting_limits(const VehicleModel<N>& vehicle, const PlanOptions& plan,
                                          const PlannerOptions& options, const VehicleState<N>& start,
                                          const Vector<3>& current, const TargetPrediction& target) {
  PlannerOptions trial = options;
  trial.deadline = std::numeric_limits<double>::infinity();
  VehicleModel<N> relaxed_vehicle = vehicle;  // without limits that the conflict does not need
  PlanOptions relaxed_plan = plan;
  const auto possible = [&](const VehicleModel<N>& v, const PlanOptions& p) {
    PlannerOptions o = trial;
    if (!p.twist) o.pursuit = unlimited(o.pursuit, p.dt);
    return Planner<N>(v, p, o).replan(start, current, target).accepted();
  };
  std::vector<PlanLimit> conflict;
  if (possible(vehicle, plan)) return conflict;
  // Tests the requested limits first, with the vehicle's own limits still in force. If a plan without the requested
  // limits exists, at least one of them is thus reported. If two limits are interchangeable, the later one is reported.
  for (const PlanLimit limit : {PlanLimit::depth, PlanLimit::roll_pitch, PlanLimit::view, PlanLimit::approach,
                                PlanLimit::keep_out, PlanLimit::commands, PlanLimit::twist}) {
    if (!is_asked(plan, limit)) continue;
    VehicleModel<N> v = relaxed_vehicle;
    PlanOptions p = relaxed_plan;
    remove_limit(limit, v, p);
    if (possible(v, p)) {
      conflict.push_back(limit);
    } else {
      relaxed_vehicle = v;
      relaxed_plan = p;
    }
  }
  return conflict;
}

template std::vector<PlanLimit> conflicting_limits(const VehicleModel<3>&, const PlanOptions&, const PlannerOptions&,
                                                   const VehicleState<3>&, const Vector<3>&, const TargetPrediction&);
template std::vector<PlanLimit> conflicting_limits(const VehicleModel<8>&, const PlanOptions&, const PlannerOptions&,
                                                   const VehicleState<8>&, const Vector<3>&, const TargetPrediction&);

}  // namespace tandem
