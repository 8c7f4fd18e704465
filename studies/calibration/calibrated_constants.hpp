#pragma once

#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/held_out_folds.hpp>

namespace tandem {

/// Estimates the constant systematic errors with the current values and noise of the problems, and cross-validates
/// them. Sets result.constants, and adds failures to result.notes. A stop before all are estimated leaves none; a later
/// stop leaves some without cross-validation.
void estimate_constants(const CalibrationProblems& problems, const HeldOutFolds& held_out,
                        const CalibrationOptions& options, ScenarioCalibration& result);

}  // namespace tandem
