#pragma once

#include <filesystem>

#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {

/// Writes a scenario folder: scenario.yaml, imu.csv, dvl.csv, depth.csv, heading.csv, gps.csv, truth_chaser.tum,
/// truth_velocity.csv (t,vx,vy,vz in the world), truth_bias.csv (t, accelerometer, gyroscope). With a target also
/// usbl.csv and truth_target.tum. Throws Error if a file cannot be written.
void write_dive(const SimulatedDive& dive, const DiveOptions& options, const std::filesystem::path& folder);

}  // namespace tandem
