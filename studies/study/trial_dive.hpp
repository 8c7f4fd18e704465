#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/study/study.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// Simulates the dive of a trial with all sensors, and with the noise that the estimator assumes.
SimulatedDive trial_dive(const TrialSettings& settings);
/// Returns the dive as a scenario without the sensor `own.without`.
Scenario dive_scenario(const SimulatedDive& dive, const OwnSensorSettings& own);
/// Returns the options for navigation by the chaser's own sensors, without covariances.
NavigationOptions dive_navigation(const Study& study, const TrialSettings& settings, const std::atomic<bool>* stop);

/// Estimated state of the chaser at one instant.
struct OwnState {
  double t;  ///< s
  EgoState state;
  std::optional<EgoCovariance> covariance{};
};
/// Adds the chaser's errors, overall and during DVL outages, and NEES to a trial result. States at times without truth
/// do not count.
void add_own_errors(const SimulatedDive& dive, const std::vector<OwnState>& states, TrialResult& result);

/// Simulates and estimates a dive without a target. With settings.window > 0 it evaluates the newest states of
/// fixed-lag smoothing, else a batch estimate. Throws Error if the estimate fails.
void run_dive_trial(const Study& study, const TrialSettings& settings, const std::atomic<bool>* stop,
                    TrialResult& result);

}  // namespace tandem
