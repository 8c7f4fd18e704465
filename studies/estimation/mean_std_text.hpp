#pragma once

#include <string>

#include <tandem/studies/estimation/estimate_metrics.hpp>

namespace tandem {

/// Formats a mean and standard deviation, for example "1.572 ± 0.766"; "–" if absent.
std::string mean_std_text(const std::optional<MeanStd>& errors, int decimals);
/// Formats the mean alone; "–" if absent.
std::string mean_text(const std::optional<MeanStd>& errors, int decimals);

}  // namespace tandem
