#pragma once

#include <string>

#include <tandem/studies/calibration/calibrate_scenarios.hpp>

namespace tandem {

/// Tables of parameters and of residuals, and what to make of them, as text for a terminal.
std::string report(const ScenarioCalibration& calibration);
/// The same as JSON.
std::string calibration_json(const ScenarioCalibration& calibration);
/// What of it the head of a noise file says.
std::string noise_file_comment(const ScenarioCalibration& calibration);

}  // namespace tandem
