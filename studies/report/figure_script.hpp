#pragma once

#include <string>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/support/plots.hpp>

namespace tandem {

/// Returns a gnuplot script that draws a figure of a page as wide as a column of a paper, with its data. It covers what
/// figures of runs use: lines, points, strips and bands in panels with a common time axis, equal or logarithmic scales,
/// and lines in space.
std::string figure_script(const HtmlFigure& figure, PlotFormat format);

}  // namespace tandem
