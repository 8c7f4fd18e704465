#pragma once

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/run_record.hpp>
#include <tandem/studies/report/time_axis.hpp>

namespace tandem {

/// Return the trajectories of a run on a plan view, north up in a NED frame; in space; and their third axis over time,
/// which points down in a NED frame.
HtmlFigure figure_from_above(const RunRecord& run);
HtmlFigure figure_in_space(const RunRecord& run);
HtmlFigure figure_of_height(const RunRecord& run, const plot::TimeAxis& time);
/// Returns whether all trajectories have one height.
bool is_planar(const RunRecord& run);

}  // namespace tandem
