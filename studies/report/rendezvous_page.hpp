#pragma once

#include <string>

#include <tandem/studies/planning/rendezvous_study.hpp>

namespace tandem {

/// One self-contained page that plays the first run of each method back in space, step by step, with what the chaser knew
/// and how long its plans took. Throws Error where plotly.js is missing (plotly_library).
std::string rendezvous_page(const RendezvousStudy& study);

}  // namespace tandem
