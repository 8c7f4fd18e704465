#pragma once

#include <span>
#include <string>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// Standard deviations in a TrackingData that scenario.yaml and the option --noise set under one name.
struct NamedNoise {
  std::string name;
  std::span<double> sigmas;
  bool required = false;  ///< true if scenario.yaml must give it
};

/// Returns all named noises of `data`; those of sensors have the sensor names. The spans are valid while `data` exists
/// and its sensors do not change.
std::vector<NamedNoise> named_noise(TrackingData& data);

/// Returns why `values` are not `expected` positive, finite standard deviations, or an empty string if they are.
std::string why_invalid_sigmas(std::span<const double> values, std::size_t expected);

/// Reads standard deviations from a key of a yaml file. Throws Error with file and line.
void read_sigmas(const YamlSection& section, const std::string& key, std::span<double> sigmas);

/// Converts standard deviations along world axes between the axes of the files and ENU. The conversion is its own
/// inverse.
void convert_noise_axes(TrackingNoise& noise, const Frame& frame);

}  // namespace tandem
