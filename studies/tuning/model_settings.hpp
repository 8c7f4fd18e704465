#pragma once

#include <map>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/select_model.hpp>

namespace tandem {

/// Settings of tuned models are options of the command line: "model" stands for --model=VALUE, "error lidar" for
/// --error=lidar=VALUE, and a flag such as "robust" has the value "true".

/// Returns the values of each option, "true" for a flag.
std::map<std::string, std::vector<std::string>> option_values(const ModelSettings& settings);
/// Returns the words of a command line for settings.
std::vector<std::string> words_of(const ModelSettings& settings);
/// Returns a change in words: "--error lidar=1.5,0.02:10".
std::string describe(const ModelSettings& settings);

}  // namespace tandem
