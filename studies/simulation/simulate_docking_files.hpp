#pragma once

#include <filesystem>

#include <tandem/studies/simulation/simulate_docking.hpp>

namespace tandem {

/// Writes a scenario folder: scenario.yaml, chaser_odometry.tum, usbl.csv, optical.csv, truth_chaser.tum,
/// truth_target.tum. Throws Error if a file cannot be written.
void write_docking(const SimulatedDocking& docking, const DockingOptions& options, const std::filesystem::path& folder);

}  // namespace tandem
