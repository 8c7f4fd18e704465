#pragma once

#include <string>
#include <vector>

#include <tandem/solvers/calibration/noise_group.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>
#include <tandem/studies/calibration/scenario_numbers.hpp>

namespace tandem {

/// The standard deviations that are meant, with their groups.
class NoiseParameters {
 public:
  /// Throws Error, with the nearest name also of `numbers`, on names of `free` that are no noise, and on noise that is named and
  /// has no residuals.
  NoiseParameters(const CalibrationProblems& problems, const ScenarioCalibrationOptions& options,
                  const std::vector<NumberEntry>& numbers = {});

  /// Takes one out.
  void keep_given(std::size_t g);
  bool has(const std::string& name) const;

  std::vector<NoiseGroup> groups;
  std::vector<std::size_t> entry, component;  ///< of each group
};

}  // namespace tandem
