#pragma once

#include <vector>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/study/study_tables.hpp>

namespace tandem {

/// Errors as boxes by values and models, against a numeric parameter, and as cumulative shares of trials; squared
/// errors in units of their covariances with their band.
std::vector<HtmlFigure> study_figures(const Study& study, const StudyTables& tables);

}  // namespace tandem
