#pragma once

#include <string>
#include <vector>

#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>

namespace tandem {

/// The folds of a cross-validation. Each fold consists of time segments spread over the recordings.
struct HeldOutFolds {
  std::vector<std::vector<HeldOutMeasurement>> folds;
  std::vector<double> segment_length;  ///< per problem [s]; empty without folds
};

/// Assigns all measurements to `n` folds: consecutive segments of 10 s or less go to the folds in turn.
HeldOutFolds make_held_out_folds(const CalibrationProblems& problems, int n);

/// Returns whether the chaser goes without position fixes for longer than a segment. Cross-validation then cannot test
/// a smaller noise of dead reckoning; adds a sentence about it to `notes`.
bool has_untested_dead_reckoning(const CalibrationProblems& problems, const HeldOutFolds& held_out,
                                 std::vector<std::string>& notes);

}  // namespace tandem
