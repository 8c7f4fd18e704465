#pragma once

#include <filesystem>
#include <vector>

#include <tandem/studies/demo/demo_fig3.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem::fig3 {

/// Writes fig3.csv, a row a pose: where it started and where it was solved to be. Throws Error.
void write_poses(const std::vector<Solution>& solutions, const std::filesystem::path& folder);

/// Its columns, for documents.
std::vector<CsvDescription> file_columns();

}  // namespace tandem::fig3
