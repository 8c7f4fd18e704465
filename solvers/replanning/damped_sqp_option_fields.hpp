#pragma once

#include <tandem/solvers/replanning/damped_sqp.hpp>

namespace tandem {

/// Options of DampedSqp by name, as in solvers/option_fields.hpp.
template <class Visit>
void visit_options(DampedSqp::Options& o, Visit& visit) {
  visit("max_iterations", o.max_iterations);
  visit("time_limit", o.time_limit);
  visit("from_multipliers", o.from_multipliers);
  visit("feasible", o.feasible);
  visit("cost_tolerance", o.cost_tolerance);
  visit("patience", o.patience);
}

}  // namespace tandem
