#pragma once

#include <vector>

#include <tandem/solvers/replanning/planner.hpp>

namespace tandem {

/// Limits of a plan: those of PlanOptions, and the range of the commands.
enum class PlanLimit { commands, twist, depth, roll_pitch, keep_out, approach, view };

/// Returns a minimal set of conflicting limits of an infeasible planning request. With all of them, the planner finds
/// no plan from this start; without any one of them, it does. If the planner finds a plan within the vehicle's own
/// limits, commands and twist, the set has at least one of the other limits. Empty if the planner finds a plan with all
/// limits, or none without any.
///
/// Plans against the prediction, up to eight times, without a deadline. Throws Error like Planner does.
///
/// Source: the deletion filter of Chinneck & Dravnieks 1991, "Locating minimal infeasible constraint sets in linear
/// programs".
template <int N>
std::vector<PlanLimit> conflicting_limits(const VehicleModel<N>& vehicle, const PlanOptions& plan,
                                          const PlannerOptions& options, const VehicleState<N>& start,
                                          const Vector<3>& current, const TargetPrediction& target);

extern template std::vector<PlanLimit> conflicting_limits(const VehicleModel<3>&, const PlanOptions&,
                                                          const PlannerOptions&, const VehicleState<3>&,
                                                          const Vector<3>&, const TargetPrediction&);
extern template std::vector<PlanLimit> conflicting_limits(const VehicleModel<8>&, const PlanOptions&,
                                                          const PlannerOptions&, const VehicleState<8>&,
                                                          const Vector<3>&, const TargetPrediction&);

}  // namespace tandem
