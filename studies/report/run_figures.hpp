#pragma once

#include <vector>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/run_record.hpp>

namespace tandem {

/// Trajectories in space and from above, errors over time in their 3 σ bands with what was measured when, and how
/// errors are distributed by type of keyframe: those of them that the run has the data for.
std::vector<HtmlFigure> run_figures(const RunRecord& run);

}  // namespace tandem
