#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/study/study.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// What a trial's chaser dives, with the noise that the estimator is told; all sensors, also one that it goes without.
SimulatedDive trial_dive(const TrialSettings& settings);
/// The same in memory as a scenario, without that sensor.
Scenario dive_scenario(const SimulatedDive& dive, const OwnSensorSettings& own);
/// How the chaser's own sensors are estimated from; no covariances.
NavigationOptions dive_navigation(const Study& study, const TrialSettings& settings, const std::atomic<bool>* stop);

/// The chaser at an instant as it was estimated.
struct OwnState {
  double t;  ///< s
  EgoState state;
  std::optional<EgoCovariance> covariance{};
};
/// Errors against the truth of a dive, in all and while its DVL is out, and NEES, into a result. States at other instants
/// than the truth's do not count.
void add_own_errors(const SimulatedDive& dive, const std::vector<OwnState>& states, TrialResult& result);

/// Simulates a dive without a target and estimates it, by all data at once or, with a window, by the newest state of each
/// keyframe. Throws Error where there is no estimate.
void run_dive_trial(const Study& study, const TrialSettings& settings, const std::atomic<bool>* stop,
                    TrialResult& result);

}  // namespace tandem
