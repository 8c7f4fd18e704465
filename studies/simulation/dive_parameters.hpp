#pragma once

#include <tandem/studies/simulation/simulate_dive.hpp>
#include <tandem/studies/support/named_parameter.hpp>

namespace tandem {

/// Returns the named parameters of DiveOptions; `seed` and `noise` have no names.
const std::vector<NamedParameter<DiveOptions>>& dive_parameters();

}  // namespace tandem
