#pragma once

#include <string>

#include <tandem/studies/estimation/estimate.hpp>

namespace tandem {

/// For a terminal: how the solve went, then errors by keyframe type as in the paper's Table I, with the raw
/// measurement's own error as the baseline; where there is more to tell of the sensors, a table of theirs, and how many
/// of the held-out measurements the predictions' 95 % intervals cover.
std::string report(const Estimate& estimate);

/// summary.json: how the solve went and errors by keyframe type, by sensor, held out; a field that the truth or the measurements
/// do not give is left out.
std::string summary_json(const Estimate& estimate);

}  // namespace tandem
