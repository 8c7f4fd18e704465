#pragma once

#include <string>

#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/support/json_fields.hpp>

namespace tandem {

/// Returns the table of the sensors' residuals and the verdict, for the results of a command.
std::string fit_text(const FitReport& fit);
/// Returns the fields of the JSON object `fit`.
JsonFields<FitReport> fit_fields();

}  // namespace tandem
