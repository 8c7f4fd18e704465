#pragma once

#include <filesystem>
#include <string>

#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/support/figure.hpp>

namespace tandem {

/// compare.svg or .png: how far the cost is from the best against time, a panel each problem. Returns why there is no
/// picture, or nothing.
std::string draw_comparison(const Comparison& comparison, PlotFormat format, const std::filesystem::path& folder);

}  // namespace tandem
