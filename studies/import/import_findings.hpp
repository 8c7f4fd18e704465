#pragma once

#include <string>
#include <vector>

#include <tandem/studies/import/import.hpp>

namespace tandem {

/// Returns one sentence for everything that looks wrong in imported data: units, signs, gaps, clocks, and elevations
/// whose sign contradicts the depth.
std::vector<std::string> import_findings(const Import& import);

/// Returns a time as UTC if it is since 1970, otherwise in seconds.
std::string time_text_of(double t);

}  // namespace tandem
