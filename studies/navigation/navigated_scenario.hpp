#pragma once

#include <memory>
#include <vector>

#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// A scenario with the navigation of its chaser, ready for the joint estimation of chaser and target.
struct NavigatedScenario {
  Scenario scenario;                        ///< has TrackingData::ego, and the navigation as odometry
  std::vector<NavigationFinding> findings;  ///< problems found in the data of the chaser's own sensors
};

/// Returns whether the chaser moves by odometry: if it has no own sensors, or if there are odometry and target sensors.
bool moves_by_odometry(const Scenario& settings);

/// Returns whether the scenario needs navigated(): it has own sensors and target sensors, but no odometry.
bool needs_navigation(const Scenario& scenario);

/// Navigates the chaser up to the end of the data of its sensors. Throws Error like navigate().
NavigatedScenario navigated(Scenario scenario, NavigationOptions options = {});

/// Replaces the odometry by a navigation of the chaser.
void set_navigation(std::shared_ptr<const EgoTrack> navigation, TrackingData& data);

}  // namespace tandem
