#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/report/html_page.hpp>

namespace tandem {

/// Returns a self-contained HTML report about a study folder or the output folder of a run. For a study, it
/// re-estimates a few trials to show them. Throws Error if the folder is neither or cannot be read.
std::string report_page(const std::filesystem::path& folder);

/// Returns the figures of the page of a run. Throws Error if the folder is not the output folder of a run.
std::vector<HtmlFigure> report_figures(const std::filesystem::path& folder);

}  // namespace tandem
