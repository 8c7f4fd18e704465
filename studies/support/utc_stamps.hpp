#pragma once

namespace tandem {

/// Later stamps count as seconds since 1970 UTC [s]; earlier ones as seconds of a local clock.
inline constexpr double kSince1970 = 3e8;

}  // namespace tandem
