#pragma once

#include <filesystem>
#include <vector>

#include <tandem/studies/planning/plan_scenario.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes planned_chaser.csv, predicted_target.csv, commands.csv, active_constraints.csv and summary.json; see
/// docs/file_formats.md. Throws Error.
void write_plan(const PlannedRun& run, const std::filesystem::path& folder);

/// The columns of those files.
std::vector<CsvDescription> plan_file_columns(const std::vector<std::string>& actuators);

}  // namespace tandem
