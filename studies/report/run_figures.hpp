#pragma once

#include <vector>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/run_record.hpp>
#include <tandem/studies/report/time_axis.hpp>

namespace tandem {

/// Returns the time axis of the run's figures.
plot::TimeAxis time_axis(const RunRecord& run);

/// Returns the figures for which the run has data, with or without truth: plan view, range and bearing, standard
/// deviations, measurements and residuals over time, depth and trajectories in space. With truth, the errors over time
/// with their bounds, and their distribution.
std::vector<HtmlFigure> run_figures(const RunRecord& run);

}  // namespace tandem
