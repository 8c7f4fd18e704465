#pragma once

namespace tandem {

/// A measurement whose robust weight ρ′ is below this value is reported as down-weighted.
inline constexpr double kDownweightThreshold = 0.5;

}  // namespace tandem
