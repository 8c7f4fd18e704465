#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {

/// Files of a scenario folder, by name.
std::vector<std::string> dive_files();
/// Writes them: scenario.yaml, imu.csv, dvl.csv, depth.csv, heading.csv, gps.csv, truth_chaser.tum, truth_velocity.csv
/// (t,vx,vy,vz in the world), truth_bias.csv (t, accelerometer, gyroscope). Throws Error.
void write_dive(const SimulatedDive& dive, const DiveOptions& options, const std::filesystem::path& folder);

}  // namespace tandem
