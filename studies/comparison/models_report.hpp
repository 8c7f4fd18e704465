#pragma once

#include <string>
#include <vector>

#include <tandem/studies/comparison/models.hpp>

namespace tandem {

/// For a terminal: a row a model, errors by keyframe type, the best of each column marked.
std::string models_report(const std::string& scenario, const std::vector<ModelResult>& results);
std::string models_csv(const std::string& scenario, const std::vector<ModelResult>& results);
std::string models_json(const std::string& scenario, const std::vector<ModelResult>& results);

}  // namespace tandem
