#pragma once

#include <string>
#include <vector>

#include <tandem/solvers/calibration/noise_group.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>
#include <tandem/studies/calibration/model_parameters.hpp>

namespace tandem {

/// The standard deviations to calibrate, with their noise groups.
class NoiseParameters {
 public:
  /// Selects the noise named in `free`, without model parameters and constants. Throws Error on an unknown name, with
  /// the nearest known one (including model parameters), and on named noise without residuals.
  NoiseParameters(const CalibrationProblems& problems, const ScenarioCalibrationOptions& options,
                  const std::vector<ModelParameterEntry>& model_parameters = {});

  /// Removes group g from calibration.
  void keep_given(std::size_t g);
  bool has(const std::string& name) const;

  std::vector<NoiseGroup> groups;
  std::vector<std::size_t> entry, component;  ///< per group: index of its entry and of its component
};

}  // namespace tandem
