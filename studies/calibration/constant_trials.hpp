#pragma once

#include <string>
#include <vector>

#include <tandem/problem/navigation/sensor_constants.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>

namespace tandem {

/// How much better held-out measurements are predicted with a constant of a sensor than without it.
struct ConstantTrial {
  std::string name;       ///< SensorConstant::name
  double gain = 0;        ///< of the log likelihood of all that is held out
  double gain_error = 0;  ///< its standard error, from the differences of the folds
};

struct ConstantTrials {
  std::vector<ConstantTrial> trials;  ///< in the constants' order; none where they were not completed
  std::string why;                    ///< they were not: a sentence
};

/// Predicts every fold's measurements out of all other data, with all constants as these find them, and with each one held
/// at none in turn, the others found again. Folds are of this problem alone, whatever LeftOut::problem says. It is left as it
/// came, solved. Throws Stopped.
ConstantTrials try_constants(Problem& problem, const std::vector<SensorConstant>& constants,
                             const std::vector<std::vector<LeftOut>>& folds, const CalibrationOptions& options = {});

}  // namespace tandem
