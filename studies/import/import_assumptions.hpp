#pragma once

#include <string>
#include <vector>

#include <tandem/studies/import/import.hpp>

namespace tandem {

/// Returns a sentence for each convention and value that neither the map nor a known message states and that the data
/// do not show: axes, units, times, signs, mountings, delays and noise.
std::vector<std::string> assumed_conventions(const Import& import);

}  // namespace tandem
