#pragma once

#include <string>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Returns a report for a terminal: the solver's summary, and errors by keyframe type as in the paper's Table I, next
/// to those of the raw measurements. If they apply, tables of the sensors and of the coverage of held-out measurements,
/// and warnings follow.
std::string report(const Estimate& estimate);

/// Returns the contents of summary.json, without fields that are not available.
std::string summary_json(const Estimate& estimate);
/// Returns the keys of summary.json.
FileDescription summary_json_keys();

}  // namespace tandem
