#pragma once

#include <string>
#include <vector>

#include <tandem/problem/navigation/sensor_constants.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>

namespace tandem {

/// The improvement in predicting held-out measurements by a constant systematic error of a sensor.
struct ConstantTrial {
  std::string name;       ///< SensorConstant::name
  double gain = 0;        ///< increase of the log-likelihood of all held-out measurements
  double gain_error = 0;  ///< standard error of the gain, from its variation over the folds
};

struct ConstantTrials {
  std::vector<ConstantTrial> trials;  ///< in the order of the constants; empty on failure
  std::string why;                    ///< the reason of the failure
};

/// Cross-validates constants. Predicts the measurements of each fold from all other data, with all constants estimated,
/// and with each constant in turn fixed to zero. All folds belong to this problem; HeldOutMeasurement::problem is
/// ignored. The problem is left unchanged and solved. Throws Stopped.
ConstantTrials cross_validate_constants(Problem& problem, const std::vector<SensorConstant>& constants,
                                        const std::vector<std::vector<HeldOutMeasurement>>& folds,
                                        const CalibrationOptions& options = {});

}  // namespace tandem
