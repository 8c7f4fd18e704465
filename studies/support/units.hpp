#pragma once

#include <numbers>

namespace tandem {

inline constexpr double kDegrees = 180.0 / std::numbers::pi;  ///< degrees per radian

}  // namespace tandem
