#pragma once

#include <string>

#include <tandem/studies/estimation/estimate.hpp>

namespace tandem {

/// Returns the states that the measurements do not determine, for example "target 4 in rotation about z". Empty if there
/// are none.
std::string unobservable_states(const Estimate& estimate);
/// Returns a sentence with these states and the options that would determine them. Empty if there are none.
std::string unobservable_text(const Estimate& estimate);

}  // namespace tandem
