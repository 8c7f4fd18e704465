#pragma once

#include <string>

#include <tandem/studies/estimation/estimate.hpp>

namespace tandem {

/// Returns a sentence with the states that the measurements do not determine and the options that would determine them.
/// Empty if there are none.
std::string unobservable_text(const Estimate& estimate);

}  // namespace tandem
