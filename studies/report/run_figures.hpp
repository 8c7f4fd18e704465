#pragma once

#include <vector>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/run_record.hpp>

namespace tandem {

/// Returns the figures for which the run has data: trajectories in space and from above, errors over time with 3 σ
/// bands and measurement times, distribution of errors by keyframe type, innovations.
std::vector<HtmlFigure> run_figures(const RunRecord& run);

}  // namespace tandem
