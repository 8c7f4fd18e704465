#pragma once

#include <vector>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/study/study_tables.hpp>

namespace tandem {

/// Returns the figures of a study: errors as box plots, against a numeric parameter, and as cumulative distribution
/// over trials; NEES and NIS with their bands.
std::vector<HtmlFigure> study_figures(const Study& study, const StudyTables& tables);

}  // namespace tandem
