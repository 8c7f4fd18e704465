#pragma once

#include <string>

#include <tandem/studies/tuning/tune.hpp>

namespace tandem {

/// Returns a page with the selected model, the steps, and the standardised residuals of each sensor by the first and by
/// the selected model. Throws Error if plotly.js is not installed.
std::string tune_page(const Tuning& tuning);

}  // namespace tandem
