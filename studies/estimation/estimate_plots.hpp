#pragma once

#include <filesystem>
#include <string>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/support/figure.hpp>

namespace tandem {

/// Draws into `folder`, by gnuplot, trajectories.* (seen from above), errors.* (by component over time, with 3 σ bands;
/// where there is truth or uncertainty) and error_norms.* (where there is truth). Empty, or a sentence that says why a
/// plot is missing.
std::string draw_plots(const Estimate& estimate, const Scenario& scenario, PlotFormat format,
                       const std::filesystem::path& folder);

}  // namespace tandem
