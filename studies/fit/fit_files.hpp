#pragma once

#include <filesystem>

#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Writes fit_residuals.csv: the standardised residuals of all measurements, and the stamps of the rejected ones.
/// Throws Error if it cannot be written.
void write_fit(const FitReport& fit, const std::filesystem::path& folder);

FileDescription fit_file_columns();

}  // namespace tandem
