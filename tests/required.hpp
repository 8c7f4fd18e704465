#pragma once

#include <cstdlib>
#include <string_view>

namespace tandem {

/// Returns true if TANDEM_REQUIRE_SHARED=1 is set, as in continuous integration: tests then fail instead of being
/// skipped if ../shared or a program is missing.
inline bool everything_required() {
  const char* const value = std::getenv("TANDEM_REQUIRE_SHARED");
  return value && *value && std::string_view(value) != "0";
}

}  // namespace tandem
