#pragma once

#include <cmath>
#include <numbers>

namespace tandem {

/// Returns the angle in [−π, π] that differs by whole turns [rad].
inline double wrapped_angle(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

}  // namespace tandem
