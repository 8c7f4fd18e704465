#pragma once

#include <filesystem>
#include <string>

#include <tandem/studies/navigation/navigation_report.hpp>
#include <tandem/studies/support/figure.hpp>

namespace tandem {

/// Draws into `folder`, by gnuplot, navigation.* (the track seen from above: estimate, truth, GPS fixes) and errors.*
/// (position and attitude by component over time, within their ±3 σ bands; without truth the bands alone). Empty, or a
/// sentence that says why a plot is missing.
std::string draw_navigation(const NavigationStudy& study, PlotFormat format, const std::filesystem::path& folder);

}  // namespace tandem
