#pragma once

#include <string>

#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// What in a recording's times would cost much time and memory, and is likely to be a mistake: a sentence, or nothing.
/// Stamps that are not in seconds, more than an hour of which nothing was recorded, as when one sensor is on another
/// clock, or more keyframes than 200,000. Takes time linear in the recording, and none in its span.
std::string implausible_times(const Scenario& scenario);

}  // namespace tandem
