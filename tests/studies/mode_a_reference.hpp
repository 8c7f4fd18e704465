#pragma once

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <tandem/studies/scenario/scenario.hpp>

#include "shared_data.hpp"

namespace tandem {

/// A row of ../shared/reference/mode_a_reference.csv: the result of an independent implementation of Mode A with only
/// the soft roll-pitch prior.
struct Reference {
  std::string scenario;
  std::size_t keyframes;
  int residual_blocks;
  double cost;
  /// Number, mean and standard deviation of the position error [m] and mean angle [deg], at keyframes with a position,
  /// with a pose, with no measurement, and at all keyframes.
  std::vector<double> errors;
};

/// Returns all rows of the file.
inline std::vector<Reference> references() {
  std::ifstream file(shared_path("reference/mode_a_reference.csv"));
  std::vector<Reference> result;
  std::string line;
  std::getline(file, line);  // header
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    Reference& reference = result.emplace_back();
    fields >> reference.scenario >> reference.keyframes >> reference.residual_blocks >> reference.cost;
    for (double value; fields >> value;) reference.errors.push_back(value);
  }
  return result;
}

inline Scenario scenario_of(const Reference& reference) {
  return read_scenario(shared_path("data") / reference.scenario);
}

}  // namespace tandem
