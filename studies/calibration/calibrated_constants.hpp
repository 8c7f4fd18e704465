#pragma once

#include <memory>
#include <vector>

#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>

namespace tandem {

using Problems = std::vector<std::unique_ptr<CalibrationProblem>>;

/// What is held out of problems in turn, and for how long at once of each [s]; nothing: no folds.
struct HeldOutStretches {
  std::vector<std::vector<LeftOut>> folds;
  std::vector<double> seconds;
};

/// Fills the result's constants, at the problems' values and noise, and tries them on what is held out: none where it is to
/// stop before all are known, some untried where it is to stop later. What could not be found or tried joins its `held`.
void find_constants(const Problems& problems, const HeldOutStretches& held_out, const CalibrationOptions& options,
                    ScenarioCalibration& result);

}  // namespace tandem
