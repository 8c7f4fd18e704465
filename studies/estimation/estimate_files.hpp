#pragma once

#include <filesystem>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes an estimate to a folder, in the scenario's frame, with full precision. Throws Error if a file cannot be
/// written. docs/file_formats.md describes the columns. Fields without a value are empty.
///
///   chaser.tum, target.tum               trajectories
///   chaser_full.csv, target_full.csv     trajectories with twists and covariances
///   errors.csv, weights.csv              errors and 3σ bounds, down-weighted measurements
///   fit_residuals.csv                    see write_fit()
///   held_out.csv                         if measurements were held out
///   chaser_at.csv, target_at.csv         see write_states_at(); if times were requested
///   summary.json                         see summary_json()
///   target_fixes.csv, *_truth.tum        for plots; *_truth.tum only if the scenario has truth
void write_results(const Estimate& estimate, const Scenario& scenario, const std::filesystem::path& folder);

/// Returns the columns of all CSV files, for documentation.
std::vector<FileDescription> estimate_file_columns();

}  // namespace tandem
