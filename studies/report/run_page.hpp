#pragma once

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/run_record.hpp>

namespace tandem {

/// Adds the page of a run: its conclusion, remarks on the data, tables of sensors, coverage, uncertainty and errors, and
/// figures. Tables and figures without data are omitted. Throws Error if summary.json has values of unexpected types.
void add_run(const RunRecord& run, HtmlPage& page);

/// Returns the figures of the page. Throws Error like add_run().
std::vector<HtmlFigure> figures_of(const RunRecord& run);

}  // namespace tandem
