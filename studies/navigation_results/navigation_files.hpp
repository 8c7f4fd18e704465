#pragma once

#include <filesystem>

#include <tandem/studies/navigation_results/navigation_report.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes a navigation to a folder, in the scenario's frame, with full precision. Throws Error if a file cannot be
/// written. docs/file_formats.md describes the columns. Fields without a value are empty.
///
///   chaser.tum                           trajectory
///   chaser_full.csv                      trajectory with velocities, biases and covariances
///   errors.csv, weights.csv              errors and 3σ bounds, down-weighted measurements
///   fit_residuals.csv                    see write_fit()
///   chaser_at.csv                        see write_states_at(); if times were requested
///   summary.json                         see navigation_json()
///   chaser_fixes.csv, gps_outages.csv, chaser_truth.tum   for plots
void write_navigation(const NavigationStudy& study, const std::filesystem::path& folder);

/// Returns the columns of all CSV files, for documentation.
std::vector<FileDescription> navigation_file_columns();

}  // namespace tandem
