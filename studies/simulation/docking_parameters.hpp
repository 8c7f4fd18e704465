#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/simulation/simulate_docking.hpp>
#include <tandem/studies/support/named_parameter.hpp>

namespace tandem {

/// Returns the named parameters of DockingOptions, all but the seed.
const std::vector<NamedParameter<DockingOptions>>& docking_parameters();

/// Reads parameters and `seed` from a YAML file of NAME: VALUE lines into `options`. Throws Error that names file and
/// line if a name or value is invalid.
void read_docking_description(const std::filesystem::path& file, DockingOptions& options);

/// Returns the parameters that differ from their defaults, as in "gap=30, waves=0.1"; empty if none does.
std::string changed_parameters(const DockingOptions& options);

}  // namespace tandem
