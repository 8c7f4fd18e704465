#pragma once

#include <vector>

#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// A scenario whose chaser has been navigated by its own sensors, so that chaser and target can be estimated together out
/// of these and the target's sensors.
struct NavigatedScenario {
  Scenario scenario;                        ///< with TrackingData::ego, and its first guess as odometry
  std::vector<NavigationFinding> findings;  ///< about the own sensors
};

/// Whether the chaser moves by odometry: where there is some, and a target; else by its own sensors.
bool moves_by_odometry(const Scenario& settings);

/// Whether the scenario has to be navigated first: it has own sensors, sensors of a target, and no odometry.
bool needs_navigation(const Scenario& scenario);

/// Throws Error as navigate() does. The navigation reaches to the end of the own sensors' data.
NavigatedScenario navigated(Scenario scenario, NavigationOptions options = {});

}  // namespace tandem
