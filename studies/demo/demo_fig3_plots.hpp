#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/demo/demo_fig3.hpp>
#include <tandem/studies/estimation/estimate_plots.hpp>

namespace tandem::fig3 {

/// Draws fig3.* into `folder`, by gnuplot: one panel beside the other, seen from above, each pose an arrow along its
/// x axis and a tick along its y axis. Empty, or a sentence that says why there is no picture.
std::string draw(const std::vector<Solution>& solutions, PlotFormat format, const std::filesystem::path& folder);

}  // namespace tandem::fig3
