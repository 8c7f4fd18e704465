#pragma once

#include <numbers>

namespace tandem {

inline constexpr double kDegrees = 180.0 / std::numbers::pi;  ///< in a radian: files and tables have degrees

}  // namespace tandem
