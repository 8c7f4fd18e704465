#pragma once

#include <string>
#include <vector>

#include <tandem/studies/fit/judged_measurements.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// Returns the sensors in a track's health, in the order of TrackHealth::sensors, with the names of their components.
std::vector<JudgedSensor> watched_sensors(const Scenario& settings);
/// Returns their names.
std::vector<std::string> names_of_watched_sensors(const Scenario& settings);

}  // namespace tandem
