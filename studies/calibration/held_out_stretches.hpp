#pragma once

#include <string>
#include <vector>

#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>

namespace tandem {

/// What is held out of problems in turn, in stretches, and how long these are of each problem [s]; nothing: no folds.
struct HeldOutStretches {
  std::vector<std::vector<LeftOut>> folds;
  std::vector<double> seconds;
};

/// All measurements, in stretches of 10 s or less that take turns in `n` folds.
HeldOutStretches held_out_stretches(const CalibrationProblems& problems, int n);

/// Whether stretches are too short to show what less noise of dead reckoning would do; says so in `held`.
bool reckons_untried(const CalibrationProblems& problems, const HeldOutStretches& held_out,
                     std::vector<std::string>& held);

}  // namespace tandem
