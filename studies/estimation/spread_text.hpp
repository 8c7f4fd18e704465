#pragma once

#include <string>

#include <tandem/studies/estimation/estimate_metrics.hpp>

namespace tandem {

/// Formats a mean and standard deviation, for example "1.572 ± 0.766"; "–" if absent.
std::string spread_shown(const std::optional<MeanStd>& spread, int decimals);

}  // namespace tandem
