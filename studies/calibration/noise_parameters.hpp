#pragma once

#include <memory>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/noise_group.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>

namespace tandem {

using CalibrationProblems = std::vector<std::unique_ptr<CalibrationProblem>>;

/// The standard deviations that are meant, with their groups.
class NoiseParameters {
 public:
  /// Throws Error on names of `free` that are neither noise nor in `others`, and on noise that is named and has no residuals.
  NoiseParameters(const CalibrationProblems& problems, const ScenarioCalibrationOptions& options,
                  const std::vector<std::string>& others = {});

  /// Takes one out.
  void keep_given(std::size_t g);
  bool has(const std::string& name) const;

  std::vector<NoiseGroup> groups;
  std::vector<std::size_t> entry, component;  ///< of each group
};

}  // namespace tandem
