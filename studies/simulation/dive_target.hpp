#pragma once

#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {

/// Adds what DiveOptions::target says to a dive: the vessel's truth at the times of the chaser's, the fixes by USBL of it, in
/// the body of the chaser, and what an estimator is told of its noise.
void add_dive_target(const DiveOptions& options, SimulatedDive& dive);

}  // namespace tandem
