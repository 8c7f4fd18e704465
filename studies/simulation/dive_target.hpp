#pragma once

#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {

/// Returns the sensor that observes the surface vessel of DiveOptions::target, without measurements.
TargetSensor dive_target_sensor(const DiveOptions& options);

/// Adds the surface vessel of DiveOptions::target to a dive: truth at the times of the chaser's truth, USBL fixes in
/// the chaser's body frame, and noise for the estimator.
void add_dive_target(const DiveOptions& options, SimulatedDive& dive);

}  // namespace tandem
