#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

struct DockingOptions {
  double minutes = 20;
  std::uint64_t seed = 1;
};

struct SimulatedDocking {
  TrackingData data;
  std::vector<Stamped<SE3>> truth_chaser, truth_target;  ///< 10 Hz, as the odometry
};

/// A rendezvous as in the built-in docking_a, of any length: a surface vessel on a course like a lawn mower's, and a
/// chaser 3 m deep that falls back, some 40 m, and comes up to 6 m again. The chaser's odometry drifts; it has a USBL fix
/// every 4 s or so while it is farther than 9 m, and an optical pose every 0.5 s while it is nearer; of either now and then
/// nothing for a while. Noises are docking_a's. The same options give the same numbers. Throws Error on options out of
/// range.
SimulatedDocking simulate_docking(const DockingOptions& options = {});

/// Writes a scenario folder: scenario.yaml, chaser_odometry.tum, usbl.csv, optical.csv, truth_chaser.tum, truth_target.tum.
/// Throws Error.
void write_docking(const SimulatedDocking& docking, const DockingOptions& options, const std::filesystem::path& folder);

}  // namespace tandem
