#include <algorithm>
#include <limits>

#include <tandem/solvers/planning/clashing_limits.hpp>

namespace tandem {
namespace {

constexpr int kMostTrialIterations = 100;
constexpr double kFarWider = 100;  // than the range of the commands, where that is no limit
constexpr double kFarFaster = 10;  // than a pursuit usually goes and turns, where no limit is on the twist

bool is_asked(const PlanOptions& plan, PlanLimit limit) {
  switch (limit) {
    case PlanLimit::commands:
      break;
    case PlanLimit::twist:
      return plan.twist.has_value();
    case PlanLimit::depth:
      return plan.lowest || plan.highest;
    case PlanLimit::roll_pitch:
      return plan.most_roll_pitch.has_value();
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
void lift(PlanLimit limit, VehicleModel<N>& vehicle, PlanOptions& plan) {
  switch (limit) {
    case PlanLimit::commands: {
      const Vector<N> range = vehicle.upper - vehicle.lower;
      vehicle.lower -= kFarWider * range;
      vehicle.upper += kFarWider * range;
      return;
    }
    case PlanLimit::twist:
      return plan.twist.reset();
    case PlanLimit::depth:
      plan.lowest.reset();
      return plan.highest.reset();
    case PlanLimit::roll_pitch:
      return plan.most_roll_pitch.reset();
    case PlanLimit::keep_out:
      plan.keep_out = 0;
      return;
    case PlanLimit::approach:
      return plan.approach.reset();
    case PlanLimit::view:
      return plan.view.reset();
  }
}

/// The start of a plan whose twist has no limit makes use of that: it is at the goal in few steps.
PursuitOptions unlimited(PursuitOptions pursuit, double dt) {
  pursuit.speed *= kFarFaster;
  pursuit.turn_rate *= kFarFaster;
  pursuit.orientation_gain = pursuit.position_gain = 1.0 / dt;
  pursuit.response = 0.5 * dt;
  return pursuit;
}

}  // namespace

template <int N>
std::vector<PlanLimit> clashing_limits(const VehicleModel<N>& vehicle, const PlanOptions& plan,
                                       const PlannerOptions& options, const VehicleState<N>& start,
                                       const Vector<3>& current, const TargetPrediction& target) {
  PlannerOptions trial = options;
  trial.deadline = std::numeric_limits<double>::infinity();
  trial.max_iterations = std::min(trial.max_iterations, kMostTrialIterations);
  VehicleModel<N> without_vehicle = vehicle;  // without what is not needed for the clash
  PlanOptions without_plan = plan;
  const auto possible = [&](const VehicleModel<N>& v, const PlanOptions& p) {
    PlannerOptions o = trial;
    if (!p.twist) o.pursuit = unlimited(o.pursuit, p.dt);
    return Planner<N>(v, p, o).replan(start, current, target).accepted();
  };
  std::vector<PlanLimit> clash;
  // What was asked for last, so that it is what is left where one of two would do.
  for (const PlanLimit limit : {PlanLimit::commands, PlanLimit::twist, PlanLimit::depth, PlanLimit::roll_pitch,
                                PlanLimit::view, PlanLimit::approach, PlanLimit::keep_out}) {
    if (!is_asked(plan, limit)) continue;
    VehicleModel<N> v = without_vehicle;
    PlanOptions p = without_plan;
    lift(limit, v, p);
    if (possible(v, p)) {
      clash.push_back(limit);
    } else {
      without_vehicle = v;
      without_plan = p;
    }
  }
  if (!clash.empty() && possible(without_vehicle, without_plan)) clash.clear();
  return clash;
}

template std::vector<PlanLimit> clashing_limits(const VehicleModel<3>&, const PlanOptions&, const PlannerOptions&,
                                                const VehicleState<3>&, const Vector<3>&, const TargetPrediction&);
template std::vector<PlanLimit> clashing_limits(const VehicleModel<8>&, const PlanOptions&, const PlannerOptions&,
                                                const VehicleState<8>&, const Vector<3>&, const TargetPrediction&);

}  // namespace tandem
