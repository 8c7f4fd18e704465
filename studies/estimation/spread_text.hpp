#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include <tandem/studies/estimation/estimate_metrics.hpp>

namespace tandem {

/// "1.572 ± 0.766", or "–" where there is none.
std::string spread_shown(const std::optional<MeanStd>& spread, int decimals);

/// Adds KEY_mean_UNIT and KEY_std_UNIT, where there is one.
void add_spread(nlohmann::ordered_json& json, const std::string& key, const std::string& unit,
                const std::optional<MeanStd>& spread);

/// n, n_with_truth where that is less, and mean and std of position and orientation [m, deg], of the estimate and of raw
/// measurements; what is not there is left out.
nlohmann::ordered_json errors_json(const ErrorSummary& errors);

}  // namespace tandem
