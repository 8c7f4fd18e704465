#pragma once

#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/held_out_stretches.hpp>

namespace tandem {

/// Fills the result's constants, at the problems' values and noise, and tries them on what is held out: none where it is to
/// stop before all are known, some untried where it is to stop later. What could not be found or tried joins its `held`.
void find_constants(const CalibrationProblems& problems, const HeldOutStretches& held_out,
                    const CalibrationOptions& options, ScenarioCalibration& result);

}  // namespace tandem
