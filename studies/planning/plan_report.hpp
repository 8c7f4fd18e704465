#pragma once

#include <string>

#include <tandem/studies/planning/plan_scenario.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Returns a summary of a few lines for a terminal.
std::string report(const PlannedRun& run);
/// Returns the content of summary.json.
std::string plan_json(const PlannedRun& run);
/// Returns the keys of summary.json.
FileDescription plan_json_keys();
/// Returns why the plan was not accepted, with the contradicting limits; empty for an accepted plan.
std::string why_not_accepted(const PlannedRun& run);

}  // namespace tandem
