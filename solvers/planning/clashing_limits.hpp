#pragma once

#include <vector>

#include <tandem/solvers/planning/planner.hpp>

namespace tandem {

/// What a plan has to keep to beside the vehicle's motion: of PlanOptions, and the range of its commands.
enum class PlanLimit { commands, twist, depth, roll_pitch, keep_out, approach, view };

/// Of a request that no plan meets, limits that clash: all of these, with the vehicle's motion from this start, leave no
/// plan that the planner finds, and without any one of them it finds one. Empty where it finds none without any limit, and
/// where it finds one with all. Plans against the prediction, up to eight times, without a deadline. Throws Error as
/// Planner.
/// Source: the deletion filter of Chinneck & Dravnieks 1991, "Locating minimal infeasible constraint sets in linear
/// programs".
template <int N>
std::vector<PlanLimit> clashing_limits(const VehicleModel<N>& vehicle, const PlanOptions& plan,
                                       const PlannerOptions& options, const VehicleState<N>& start,
                                       const Vector<3>& current, const TargetPrediction& target);

extern template std::vector<PlanLimit> clashing_limits(const VehicleModel<3>&, const PlanOptions&,
                                                       const PlannerOptions&, const VehicleState<3>&, const Vector<3>&,
                                                       const TargetPrediction&);
extern template std::vector<PlanLimit> clashing_limits(const VehicleModel<8>&, const PlanOptions&,
                                                       const PlannerOptions&, const VehicleState<8>&, const Vector<3>&,
                                                       const TargetPrediction&);

}  // namespace tandem
