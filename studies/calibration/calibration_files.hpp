#pragma once

#include <filesystem>
#include <vector>

#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes the result files, from which plots are drawn: summary.json, parameters.csv, evidence.csv, residuals.csv and
/// autocorrelation.csv; with constants also constants.csv and constants_evidence.csv.
void write_results(const ScenarioCalibration& calibration, const std::filesystem::path& folder);

/// Returns descriptions of the columns of these files.
std::vector<FileDescription> calibration_file_columns();

}  // namespace tandem
