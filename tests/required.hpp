#pragma once

#include <cstdlib>
#include <string_view>

namespace tandem {

/// Whether what a test cannot do without, ../shared or a program, has to be there, as in continuous integration:
/// TANDEM_REQUIRE_SHARED=1.
inline bool everything_required() {
  const char* const value = std::getenv("TANDEM_REQUIRE_SHARED");
  return value && *value && std::string_view(value) != "0";
}

}  // namespace tandem
