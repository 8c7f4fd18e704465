#pragma once

#include <span>
#include <string>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// The standard deviations inside `data` that go by one name in scenario.yaml and on the command line.
struct NamedNoise {
  std::string name;
  std::span<double> sigmas;
  bool required = false;  ///< a scenario has to give it: there is no default
};

/// All of them, the sensors' under the sensors' names. Valid while `data` lives and keeps its sensors.
std::vector<NamedNoise> named_noise(TrackingData& data);

/// Empty, or what is wrong with `values` as the standard deviations of `noise`.
std::string why_not_sigmas(std::span<const double> values, std::size_t expected);

/// Reads them from a key of a yaml file. Throws Error naming file and line.
void read_sigmas(const YamlSection& section, const std::string& key, std::span<double> sigmas);

/// Turns noise along the world's axes from a file's frame into ours; its own inverse.
void turn_noise(TrackingNoise& noise, const Frame& frame);

}  // namespace tandem
