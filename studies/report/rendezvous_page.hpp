#pragma once

#include <string>

#include <tandem/studies/rendezvous/rendezvous_study.hpp>

namespace tandem {

/// Returns a self-contained page with the outcome of all runs. It animates the first run of each method in space and
/// plots its estimation errors and solve times. Throws Error if plotly.js is missing (plotly_library).
std::string rendezvous_page(const RendezvousStudy& study);

}  // namespace tandem
