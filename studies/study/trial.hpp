#pragma once

#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>
#include <tandem/studies/study/study.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// Simulates the docking of a trial, with the sigmas that its estimator assumes.
SimulatedDocking trial_docking(const TrialSettings& settings);

/// Estimation problem of a trial with a target.
struct TrialProblem {
  TrialSettings settings;
  std::optional<SimulatedDive> dive;  ///< set if the study simulates dives
  Scenario scenario;                  ///< includes the truth; in a dive, the chaser has its own sensors
  std::vector<std::pair<double, double>> gaps;
  TrackingOptions options;
  AnySolver solver;
};
/// Simulates the measurements of a trial and returns its estimation problem. Requires a study with a target.
TrialProblem trial_problem(const Study& study, std::size_t trial, const std::atomic<bool>* stop = nullptr);

/// Simulates and estimates a trial: a target with its chaser, a chaser alone, or a rendezvous. Except for times, the
/// result depends only on the study and the trial number. Errors are stored in the result with their reason. `stop`
/// ends the trial if true, with a result that does not count; any thread may set it. Thread-safe; each trial runs in
/// one thread (ThreadLimit).
TrialResult run_trial(const Study& study, std::size_t trial, const std::atomic<bool>* stop = nullptr);

}  // namespace tandem
