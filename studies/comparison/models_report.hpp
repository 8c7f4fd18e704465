#pragma once

#include <string>
#include <vector>

#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Returns a report for a terminal: the models with the least errors, and one row per model with errors by keyframe
/// type, which marks the best of each column. Shows the 20 models with the least position errors, or all with `full`.
std::string models_report(const std::string& scenario, const std::vector<ModelResult>& results, bool full = false);
/// Returns the contents of models.csv: one row per model, with full precision.
std::string models_csv(const std::string& scenario, const std::vector<ModelResult>& results);
/// Returns all results as JSON, for --json.
std::string models_json(const std::string& scenario, const std::vector<ModelResult>& results);

/// Returns the keys of that JSON document.
FileDescription models_json_keys();

/// Returns the columns of models.csv, for documentation.
std::vector<FileDescription> models_file_columns();

}  // namespace tandem
