#pragma once

#include <filesystem>
#include <vector>

#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// What pictures are drawn from: summary.json, parameters.csv, evidence.csv, residuals.csv, autocorrelation.csv; where there are
/// constants, constants.csv and constants_evidence.csv.
void write_results(const ScenarioCalibration& calibration, const std::filesystem::path& folder);

/// What the columns of these files are.
std::vector<CsvDescription> calibration_file_columns();

}  // namespace tandem
