#pragma once

#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>
#include <tandem/studies/study/study.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// What a trial of a docking simulates, with the sigmas that its estimator is told.
SimulatedDocking trial_docking(const TrialSettings& settings);

/// What a trial with a target estimates, and how.
struct TrialProblem {
  TrialSettings settings;
  std::optional<SimulatedDive> dive;  ///< where that is simulated
  Scenario scenario;                  ///< in memory, with the truth; of a dive navigated by its own sensors
  std::vector<std::pair<double, double>> gaps;
  TrackingOptions options;
  Solver solver;
};
TrialProblem trial_problem(const Study& study, std::size_t trial, const std::atomic<bool>* stop = nullptr);

/// Simulates and estimates a trial: a target with its chaser, a chaser alone, or a rendezvous. What is refused, or ends
/// with an error, is in the result with its reason. The result depends on the study and the number alone, but for times.
/// `stop`: set it from anywhere to end early; the result is then not that of the trial. Any number of threads may call
/// it; a trial is evaluated in one (ThreadLimit).
TrialResult run_trial(const Study& study, std::size_t trial, const std::atomic<bool>* stop = nullptr);

}  // namespace tandem
