#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// The words on a command line that say what is to be navigated and how, as they were typed; nothing where an option was
/// not given.
struct NavigationArguments {
  std::string scenario;
  std::vector<std::string> without, noise, loss, delay, fit_delay;
  std::optional<std::string> keyframe_interval, alignment;
  bool dvl_scale = false, preintegrated_dvl = false, no_earth_rotation = false;
};

/// What the options mean. Throws Error on words that make no sense.
NavigationOptions navigation_options(const NavigationArguments& arguments);

/// The scenario with the noise, losses, keyframes and Earth that the arguments ask for. It has all its sensors: what the
/// truth is of can depend on one that the navigation does without. Throws Error, also where there is nothing to navigate
/// by.
Scenario scenario_to_navigate(const NavigationArguments& arguments);

/// The sensors whose delay is to be fitted, as indices. Throws Error on names that there are not.
std::vector<std::size_t> delays_to_fit(const NavigationData& data, const NavigationArguments& arguments);

/// What is navigated by: the scenario's own sensors but for those that --without names. Throws Error on names that there
/// are not, and on options about sensors that are left out.
NavigationData sensors_in_use(const Scenario& scenario, const NavigationArguments& arguments);

}  // namespace tandem
