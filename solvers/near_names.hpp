#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// "; did you mean X?" with the nearest of the known words, or nothing where none is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace tandem
