#pragma once

#include <string>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/support/plots.hpp>

namespace tandem {

/// Returns the picture of a figure. Throws Error that names the figure if gnuplot is missing or fails.
std::string draw_figure(const HtmlFigure& figure, PlotFormat format);

/// Returns the name of the file of a figure without extension, from its title: "residuals_over_time".
std::string figure_name(const HtmlFigure& figure);

}  // namespace tandem
