#pragma once

#include <functional>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/select_model.hpp>
#include <tandem/studies/calibration/misfit.hpp>
#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/scenario/noise_file.hpp>

namespace tandem {

/// A scenario with the options of its problem.
struct TunedProblem {
  Scenario scenario;
  TrackingOptions target;
  NavigationOptions own;
};

struct TuneOptions {
  /// Applies settings (model_settings.hpp) to a scenario as it was read. Called from several threads.
  std::function<TunedProblem(const Scenario& scenario, const ModelSettings& settings)> apply;
  ModelSettings start{};             ///< the settings that the user gives
  std::vector<std::string> only{};   ///< names of what may change: an option, a sensor, or both; empty: everything
  std::vector<std::string> fixed{};  ///< names of what keeps its value
  double ahead = 0;                  ///< ScoreOptions::ahead; 0: held_out_time_ahead()
  bool dry_run = false;              ///< proposes candidates, but does not score them
  Stop stop{};
  std::function<void(const std::string& what)> progress{};
};

/// Result of tune().
struct Tuning {
  std::vector<std::string> scenarios;
  double block_length = 0;              ///< length of the held-out blocks of time [s]
  double ahead = 0;                     ///< time of predictions from earlier measurements only [s]; 0: none
  std::vector<ModelChange> candidates;  ///< proposed for the start
  ModelSelection selection;             ///< empty in a dry run
  ModelSettings given;                  ///< the settings of the user
  ModelSettings start;                ///< the model from which the search starts; others than the given ones are needed
  std::vector<Misfit> before, after;  ///< residuals by the first and by the selected model
  std::vector<NoiseEntry> noise;  ///< noise of the selected model without systematic errors, in the axes of the files
  double seconds = 0;

  bool changed() const { return selection.settings != given; }
};

/// Finds the model of recordings of one system that predicts held-out measurements best, without truth: proposes
/// changes from the residuals and selects among them by select_model().
///
/// Throws Error if a recording is too short for five blocks of time, if the sensors of the recordings differ, if names
/// in `only` or `fixed` are unknown or contradict each other, or if the start cannot be solved. Throws Stopped if the
/// time is too short for the start.
Tuning tune(const std::vector<Scenario>& scenarios, const TuneOptions& options);

}  // namespace tandem
