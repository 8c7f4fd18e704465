#pragma once

#include <string>

namespace tandem {

/// The source of plotly.js that reports have inside: share/tandem/report/plotly.min.js, which scripts/setup and the
/// build put there, else that of Debian's python3-plotly. Throws Error that says what to install where there is
/// neither.
std::string plotly_library();

}  // namespace tandem
