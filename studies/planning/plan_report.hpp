#pragma once

#include <string>

#include <tandem/studies/planning/plan_scenario.hpp>

namespace tandem {

/// The plan in a few lines for a terminal.
std::string report(const PlannedRun& run);
/// All figures of it, as summary.json.
std::string plan_json(const PlannedRun& run);
/// A sentence for people when the plan violates a hard constraint; empty when it was accepted.
std::string why_not_accepted(const PlannedRun& run);

}  // namespace tandem
