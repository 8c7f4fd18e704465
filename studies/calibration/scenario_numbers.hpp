#pragma once

#include <functional>
#include <string>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/scenario/noise_file.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// A number by which problems are built, and that `--free` names: a time constant of the target's motion ("twist_time.x"),
/// that of a sensor's error ("lidar.time"), degrees of freedom ("usbl.dof").
struct ScenarioNumber {
  std::string name, entry;    ///< "twist_time.x" of "twist_time"
  std::size_t component = 0;  ///< of the entry, as files have it
  double given = 0;
  bool time = true;                            ///< s; else degrees of freedom
  std::function<void(Scenario&, double)> set;  ///< of any scenario with such a sensor
};

/// Takes out of `free` the names of such numbers, in the order of a noise file. Throws Error, with what to do, on one that the
/// scenario or its problem has not.
std::vector<ScenarioNumber> take_numbers(const Scenario& scenario, const TrackingOptions& target,
                                         const NavigationOptions& own, std::vector<std::string>& free);
/// Their entries as given, whole.
std::vector<NoiseEntry> entries_of(const std::vector<ScenarioNumber>& numbers, const Scenario& scenario);

/// What `--free` knows such numbers by.
struct NumberEntry {
  std::string name;                     ///< "twist_time", "lidar.time"
  std::vector<std::string> components;  ///< "x", …; of sensors none
  bool there = false;                   ///< the scenario, or its problem, has it
};
std::vector<NumberEntry> number_entries(const Scenario& scenario, const TrackingOptions& target,
                                        const NavigationOptions& own);

}  // namespace tandem
