#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/simulation/simulate_docking.hpp>
#include <tandem/studies/support/named_parameter.hpp>

namespace tandem {

/// All of DockingOptions by their names, but for the seed.
const std::vector<NamedParameter<DockingOptions>>& docking_parameters();

/// Reads NAME: VALUE lines of a yaml file, parameters and `seed`, into the options. Throws Error that names file and
/// line.
void read_docking_description(const std::filesystem::path& file, DockingOptions& options);

/// "gap=30, waves=0.1": what differs from the default; empty where nothing does.
std::string changed_parameters(const DockingOptions& options);

}  // namespace tandem
