#pragma once

#include <string>

namespace tandem {

enum class PlotFormat { svg, png };

inline constexpr int kFigureWidth = 900;  ///< pixels

/// gnuplot's settings for a figure of the house style: title and key above it on the left, light axes.
std::string figure_style(PlotFormat format, int height, const std::string& title);

/// A gnuplot data block of named points, which may be none.
std::string points_block(const std::string& name, const std::string& lines);

}  // namespace tandem
