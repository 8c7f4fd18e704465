#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/predictive_score.hpp>

namespace tandem {

/// The settings of a model that differ from the user's defaults, by name: for example {"model": "damped-twist"}.
using ModelSettings = std::map<std::string, std::string>;

/// A candidate change of a model.
struct ModelChange {
  ModelSettings settings;  ///< values to set; an empty value resets a setting
  std::string why;         ///< what suggests the change, for tables
  double parameters = 1;   ///< number of parameters that the change adds, or that were chosen with the same data
};

/// Problems of a model and their measurements. Problems of all models have the same order.
struct BuiltModel {
  std::vector<std::shared_ptr<Problem>> problems;
  std::vector<ScoredMeasurement> measurements;
};

/// Builds the problems of a model. Called from several threads. Throws Error if the model cannot be built.
using BuildModel = std::function<BuiltModel(const ModelSettings& settings)>;

/// Decision about a candidate.
enum class ModelVerdict {
  kept,
  not_better,    ///< the gain is within its standard error, or below the number of parameters
  inconsistent,  ///< it predicts better, but fewer held-out measurements are inside of their intervals
  impossible,    ///< the problems cannot be built or solved, or ModelSelectionOptions::why_unusable gives a reason
  needed,        ///< the caller's start has it, whatever it gains
  removed,       ///< an earlier change that the later ones make unnecessary
};
std::string_view name(ModelVerdict verdict);

/// One evaluated change.
struct ModelStep {
  ModelChange change;
  ScoreGain gain;  ///< over the model at that step
  ModelVerdict verdict = ModelVerdict::not_better;
  std::string why;  ///< explanation of `impossible`
};

struct ModelSelectionOptions {
  ScoreOptions score;
  ModelSettings start{};  ///< the model at the start
  /// Ends the search with the best model so far.
  Stop stop{};
  /// Returns further candidates for a model, for example other values of its parameters. Not called concurrently.
  std::function<std::vector<ModelChange>(const ModelSettings& current)> propose{};
  /// Returns whether a model may be selected; by default, all may. Removals of changes are tested, too.
  std::function<bool(const ModelSettings& settings)> allowed{};
  /// Returns why a model cannot be used although it predicts better, or an empty string. Called for models that would be
  /// kept, with the settings of the whole model. By default, all can be used.
  std::function<std::string(const ModelSettings& settings)> why_unusable{};
  /// Called after each evaluation with the number of models scored and the best gain so far.
  std::function<void(int models, double gain)> progress{};
};

struct ModelSelection {
  ModelSettings settings;        ///< the selected model
  PredictiveScore start, found;  ///< scores of the first and of the selected model, on the same measurements
  ScoreGain gain;                ///< of the selected model over the first one
  std::vector<ModelStep> steps;  ///< in the order of evaluation; without repetitions of rejected changes
  int models = 0;                ///< number of models that were scored
  bool cut_short = false;        ///< stopped early
};

/// Finds the model that predicts held-out measurements best, by greedy search.
///
/// All candidates are screened by a third of the held-out blocks, and the best ones are scored by all. A candidate is
/// kept if its gain exceeds its standard error and its number of parameters; the others follow in the order of their
/// gains, each on top of those kept before. Then changes that the model does not need are removed: those without which
/// it predicts no worse by more than a standard error. The result is the simplest model that is not worse, and does not
/// depend on the number of threads.
///
/// Screening starts from the solution of the current model. Finalists are solved from there and from their own initial
/// guess, since losses and motion models have local minima. The search repeats with the candidates that gained and the proposed ones, until it keeps
/// none.
///
/// A candidate with a larger share of measurements outside the 95 % intervals, beyond the standard errors, is not
/// kept. Throws Error if the first model cannot be built or solved, and as predictive_score(). A stop before the first
/// model is scored throws Stopped.
ModelSelection select_model(const BuildModel& build, const std::vector<ModelChange>& candidates,
                            const ModelSelectionOptions& options);

/// Returns the settings after a change.
ModelSettings changed(ModelSettings settings, const ModelChange& change);

}  // namespace tandem
