#pragma once

#include <functional>
#include <string>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/scenario/noise_file.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// A parameter that a problem is built from, named by `--free`. It is a time constant of the target's motion
/// ("twist_time.x"), the correlation time of a sensor's error ("lidar.time"), or the degrees of freedom of a loss
/// ("usbl.dof").
struct ModelParameter {
  std::string name, entry;                     ///< "twist_time.x" and "twist_time".
  std::size_t component = 0;                   ///< Index in the entry, in the order of the files.
  double given = 0;                            ///< Given value.
  bool time = true;                            ///< Whether it is a time [s]; else degrees of freedom.
  std::function<void(Scenario&, double)> set;  ///< Sets the value in any scenario that has the parameter.
};

/// Removes the names of model parameters from `free` and returns these parameters in the order of a noise file. Throws
/// Error, with a remedy, on a parameter that the scenario or its motion model does not have.
std::vector<ModelParameter> take_model_parameters(const Scenario& scenario, const TrackingOptions& target,
                                                  const NavigationOptions& own, std::vector<std::string>& free);
/// Returns the complete entries of the parameters with the given values.
std::vector<NoiseEntry> entries_of(const std::vector<ModelParameter>& parameters, const Scenario& scenario);

/// A name that `--free` accepts for model parameters.
struct ModelParameterEntry {
  std::string name;                     ///< "twist_time", "lidar.time"
  std::vector<std::string> components;  ///< "x", …; empty for sensors
  bool available = false;               ///< whether the scenario and its motion model have it
};
std::vector<ModelParameterEntry> model_parameter_entries(const Scenario& scenario, const TrackingOptions& target,
                                                         const NavigationOptions& own);

}  // namespace tandem
