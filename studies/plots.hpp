#pragma once

#include <filesystem>
#include <string>

#include <tandem/studies/estimate.hpp>

namespace tandem {

enum class PlotFormat { svg, png };

/// Draws into `folder`, by gnuplot, trajectories.* (seen from above) and, where there is truth, errors.*
/// (over time). Empty, or a sentence that says why a plot is missing.
std::string draw_plots(const Estimate& estimate, const Scenario& scenario, PlotFormat format,
                       const std::filesystem::path& folder);

}  // namespace tandem
