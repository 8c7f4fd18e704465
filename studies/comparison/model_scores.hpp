#pragma once

#include <functional>
#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/comparison/models.hpp>

namespace tandem {

/// Scores the solved models by predictions of held-out measurements (predictive_score()), without truth. Sets
/// ModelResult::score, or `why_no_score`. The blocks of time are those of the first model that can be scored; all
/// scores are on its measurements. Calls `progress` before each model with its number. Stops early if `stop` requests
/// it.
void score_models(const Scenario& scenario, const std::vector<NamedModel>& models, std::vector<ModelResult>& results,
                  const Stop& stop, const std::function<void(std::size_t model)>& progress = {});

/// Returns the index of the result with the best score, or nullopt.
std::optional<std::size_t> best_score(const std::vector<ModelResult>& results);

/// Returns which model predicts best, and which are no worse by a standard error; empty without scores.
std::string recommendation(const std::vector<ModelResult>& results);

}  // namespace tandem
