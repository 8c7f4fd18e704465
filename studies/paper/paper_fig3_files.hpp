#pragma once

#include <filesystem>
#include <vector>

#include <tandem/studies/paper/paper_fig3.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem::fig3 {

/// Writes fig3.csv: one row per pose with its initial guess and solution. Throws Error if the file cannot be written.
void write_poses(const std::vector<Solution>& solutions, const std::filesystem::path& folder);

/// Returns the columns of fig3.csv, for documentation.
std::vector<FileDescription> file_columns();

}  // namespace tandem::fig3
