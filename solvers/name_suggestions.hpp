#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// Returns "; did you mean X?" with the known word nearest to `word`, or an empty string if none is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace tandem
