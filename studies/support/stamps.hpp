#pragma once

#include <filesystem>
#include <vector>

namespace tandem {

/// Reads times [s] from a text file, in the order of its lines. Each line has one time, alone or in a column of a table
/// that is separated by commas, semicolons, tabs or blanks. If the first line has names, the column is `t`, `time`,
/// `stamp` or `timestamp`, or the only one; otherwise it is the first one. Empty lines and lines that start with # are
/// skipped. Times may repeat and need not be sorted. Throws Error, with the file and the line, if a time is missing or
/// not a finite number, and if there is none.
std::vector<double> read_stamps(const std::filesystem::path& file);

}  // namespace tandem
