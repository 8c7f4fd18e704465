#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/estimation/estimate.hpp>

namespace tandem {

/// A motion model of the target with its constraints, under the name that selects it.
struct NamedModel {
  std::string name;
  TrackingOptions options;
};

/// The models that `tandem models` compares when none are named; each is what parse_model_spec takes.
std::vector<std::string> default_models();

/// A model out of parts joined by '+', e.g. "constant-twist+non-holonomic:hard+surge:0,2.5+horizons:1,2", on top of
/// `base`. The first part may be a motion model by its name (constant-twist where none is given), mode-b or multi-horizon
/// (constant twist with horizons 1,2,4). The others, hard where no role is said:
///
///     non-holonomic[:ROLE]  roll-pitch[:ROLE]  surge[:MIN,MAX][:ROLE]  yaw-rate[:MAX][:ROLE]  all[:ROLE]  horizons:LIST
///
/// with ROLE soft or hard; limits without numbers are those of `base`, else surge ≥ 0 m/s and yaw rate ±0.3 rad/s; `all`
/// is the first four. Throws Error that says what is taken and, where one is near, what may have been meant.
NamedModel parse_model_spec(const std::string& option, const std::string& spec, const TrackingOptions& base);

/// What parse_model_spec takes, for help: "MODEL: constant-twist, …. CONSTRAINT: non-holonomic, …."
std::string model_spec_words();

/// A list of them by commas; a comma before a number belongs to the model before it.
std::vector<NamedModel> parse_model_list(const std::string& option, const std::string& text,
                                         const TrackingOptions& base);

/// How a model did.
struct ModelResult {
  std::string name, solver;
  std::string status;   ///< name(Status); "refused" when data and model make no problem or the solver cannot take it
  std::string message;  ///< one sentence
  bool solved = false;  ///< the numbers below are there
  double cost = 0, violation = 0, seconds = 0;
  int iterations = 0;
  ErrorSummary usbl, optical, gated, all;
};

/// What solves a model: gauss-newton or, when it has hard constraints, augmented-lagrangian.
Solver solver_for(const NamedModel& model);

ModelResult try_model(const Scenario& scenario, const NamedModel& model, const Solver& solver);

}  // namespace tandem
