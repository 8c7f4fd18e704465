#pragma once

namespace tandem {

/// Below this weight ρ′ a measurement counts as down-weighted by its robust loss.
inline constexpr double kDownWeighted = 0.5;

}  // namespace tandem
