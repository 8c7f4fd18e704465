#pragma once

#include <string>
#include <vector>

#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// For a terminal: a row a model, errors by keyframe type, the best of each column marked.
std::string models_report(const std::string& scenario, const std::vector<ModelResult>& results);
std::string models_csv(const std::string& scenario, const std::vector<ModelResult>& results);
std::string models_json(const std::string& scenario, const std::vector<ModelResult>& results);

/// The columns of models.csv, for documents.
std::vector<CsvDescription> models_file_columns();

}  // namespace tandem
