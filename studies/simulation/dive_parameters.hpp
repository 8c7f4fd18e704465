#pragma once

#include <tandem/studies/simulation/simulate_dive.hpp>
#include <tandem/studies/support/named_parameter.hpp>

namespace tandem {

/// Those of DiveOptions that have names, but for the seed.
const std::vector<NamedParameter<DiveOptions>>& dive_parameters();

}  // namespace tandem
