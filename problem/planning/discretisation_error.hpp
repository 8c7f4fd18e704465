#pragma once

#include <tandem/problem/planning/plan_problem.hpp>

namespace tandem {

/// Largest difference between a plan and the motion in continuous time under the commands of the plan, over the
/// instants of the plan.
struct DiscretisationError {
  double position = 0.0;  ///< m
  double heading = 0.0;   ///< angle between the horizontal directions of the body's x axis [rad], from 0 to π
};

/// Returns the discretisation error of a plan with steps of `dt` [s] in a current [m/s] along the world axes.
///
/// A plan follows the implicit midpoint rule with steps of `dt`. The reference applies the same commands, without
/// feedback, with much shorter steps of the same rule. It halves them until the error changes by less than 1 %. The
/// reference has no feedback, so an unstable vehicle amplifies the error along the plan.
template <int N>
DiscretisationError discretisation_error(const VehicleModel<N>& vehicle, const Plan<N>& plan, double dt,
                                         const Vector<3>& current);

extern template DiscretisationError discretisation_error(const VehicleModel<3>&, const Plan<3>&, double,
                                                         const Vector<3>&);
extern template DiscretisationError discretisation_error(const VehicleModel<8>&, const Plan<8>&, double,
                                                         const Vector<3>&);

}  // namespace tandem
