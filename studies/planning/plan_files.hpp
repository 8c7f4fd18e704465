#pragma once

#include <filesystem>
#include <vector>

#include <tandem/studies/planning/plan_scenario.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes planned_chaser.csv, predicted_target.csv, commands.csv, active_constraints.csv and summary.json into
/// `folder`. docs/file_formats.md describes them. Throws Error if a file cannot be written.
void write_plan(const PlannedRun& run, const std::filesystem::path& folder);

/// Returns the columns of the CSV files of write_plan().
std::vector<FileDescription> plan_file_columns(const std::vector<std::string>& actuators);

}  // namespace tandem
