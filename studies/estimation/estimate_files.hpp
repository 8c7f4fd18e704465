#pragma once

#include <filesystem>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes what was estimated, numbers to the last digit, all in the scenario's frame; a field that does not exist is
/// empty: chaser.tum, target.tum, chaser_full.csv, target_full.csv, errors.csv, weights.csv, held_out.csv when measurements
/// were held out, summary.json (see estimate_report.hpp) and, for plots, target_fixes.csv, chaser_truth.tum and
/// target_truth.tum. `scenario` has the truth, if there is one. Throws Error. The columns are in docs/file_formats.md.
void write_results(const Estimate& estimate, const Scenario& scenario, const std::filesystem::path& folder);

/// The columns of all files, for documents.
std::vector<CsvDescription> estimate_file_columns();

}  // namespace tandem
