#pragma once

#include <filesystem>
#include <string>

#include <tandem/studies/estimate.hpp>

namespace tandem {

/// For a terminal: how the solve went, then errors by keyframe type as in the paper's Table I, with the raw
/// measurement's own error as the baseline.
std::string report(const Estimate& estimate);

/// summary.json: how the solve went and errors by keyframe type; a field that the truth or the measurements
/// do not give is left out.
std::string summary_json(const Estimate& estimate);

/// Writes chaser.tum, target.tum, errors.csv and summary.json, numbers to the last digit. Throws Error.
void write_results(const Estimate& estimate, const std::filesystem::path& folder);

}  // namespace tandem
