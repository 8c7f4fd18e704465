#pragma once

#include <string>

#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Returns the report for a terminal: tables of parameters, constants and residuals, and the validation.
std::string report(const ScenarioCalibration& calibration);
/// Returns the results as JSON.
std::string calibration_json(const ScenarioCalibration& calibration);
/// Returns the keys of that JSON document.
FileDescription calibration_json_keys();
/// Returns the name of a constant in tables and files: "NAME of SCENARIO" if there are several scenarios.
std::string display_name(const ScenarioCalibration& calibration, const CalibratedConstant& constant);
/// Returns the comment at the head of a noise file.
std::string noise_file_comment(const ScenarioCalibration& calibration);

}  // namespace tandem
