#pragma once

#include <filesystem>

#include <tandem/studies/navigation/more/navigation_report.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes what was navigated, numbers to the last digit, all in the scenario's frame; a field that does not exist is empty:
/// chaser.tum, chaser_full.csv, errors.csv, weights.csv, summary.json (see navigation_report.hpp) and, for plots,
/// chaser_fixes.csv, gps_outages.csv and chaser_truth.tum. Throws Error. The columns are in docs/file_formats.md.
void write_navigation(const NavigationStudy& study, const std::filesystem::path& folder);

/// The columns of all files, for documents.
std::vector<CsvDescription> navigation_file_columns();

}  // namespace tandem
