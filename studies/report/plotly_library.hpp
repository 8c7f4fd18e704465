#pragma once

#include <string>

namespace tandem {

/// Returns the source of plotly.js for reports: share/tandem/report/plotly.min.js, which scripts/setup and the build
/// install, or else that of Debian's python3-plotly. Throws Error that says what to install if both are missing.
std::string plotly_library();

}  // namespace tandem
