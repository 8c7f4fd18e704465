#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/predictive_score.hpp>
#include <tandem/studies/estimation/estimate.hpp>

namespace tandem {

/// A motion model of the target with constraints, and the specification that selects it.
struct NamedModel {
  std::string name;
  TrackingOptions options;
};

/// Returns the specifications of the models that `tandem models` compares by default.
std::vector<std::string> default_models();

/// Parses a model specification: parts joined by '+', for example
/// "constant-twist+non-holonomic:hard+surge:0,2.5+horizons:1,2". Options that it does not set are those of `base`.
///
/// The first part may be the name of a motion model, mode-b, or multi-horizon (constant twist with horizons 1,2,4). The
/// default is the model of `base`. The other parts are constraints and horizons:
///
///   non-holonomic[:ROLE]  roll-pitch[:ROLE]  surge[:MIN,MAX][:ROLE]  yaw-rate[:MAX][:ROLE]  all[:ROLE]  horizons:LIST
///
/// ROLE is soft or hard (default hard). Limits without numbers are those of `base`, else surge ≥ 0 m/s and yaw rate
/// ±0.3 rad/s. `all` stands for the first four. Throws Error with the valid words and, if one is similar, a suggestion.
NamedModel parse_model_spec(const std::string& option, const std::string& spec, const TrackingOptions& base);

/// Describes the syntax of a specification, for help texts: "MODEL: constant-twist, …. CONSTRAINT: non-holonomic, …."
std::string model_spec_words();

/// Parses a comma-separated list of specifications. A comma before a number belongs to the preceding specification.
std::vector<NamedModel> parse_model_list(const std::string& option, const std::string& text,
                                         const TrackingOptions& base);

/// Result of estimating a scenario with one model.
struct ModelResult {
  std::string name, solver;
  std::string status;   ///< name(Status); "refused" if data and model give no valid problem or the solver rejects it
  std::string message;  ///< explanation of the status
  bool solved = false;  ///< whether the numbers below are valid
  double cost = 0, violation = 0, seconds = 0;
  int iterations = 0;
  std::array<ErrorSummary, keyframe_types.size()> errors;  ///< in the order of keyframe_types
  ErrorSummary all;
  /// Predictions of held-out measurements; set by score_models().
  std::optional<PredictiveScore> score{};
  std::string why_no_score{};
};

/// Returns the default solver of a model: augmented-lagrangian if it has hard constraints, else gauss-newton.
AnySolver solver_for(const NamedModel& model);

/// Estimates the scenario with a model. Never throws Error: `status` and `message` report it.
ModelResult evaluate_model(const Scenario& scenario, const NamedModel& model, const AnySolver& solver);

}  // namespace tandem
