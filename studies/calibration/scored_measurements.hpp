#pragma once

#include <vector>

#include <tandem/solvers/calibration/predictive_score.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>

namespace tandem {

/// Returns the measurements of the problems for predictive_score(). The parts of a pose are its position and its
/// orientation; other measurements have one part. The number of a sensor is that of its entry in
/// CalibrationProblem::entries.
std::vector<ScoredMeasurement> scored_measurements(const CalibrationProblems& problems);

/// Returns the length of the blocks of time for held-out measurements, from the longest correlation time of the
/// residuals at the current values; see score_block_length(). Returns 0 if a recording is too short for blocks. Throws
/// Error if a problem has no covariances, and Stopped.
double held_out_block_length(const CalibrationProblems& problems, const Stop& stop);

/// Returns the time for ScoreOptions::ahead that tests what the recordings ask of the motion model: the longest time
/// without a measured position of the target, at most half of the recording [s]. Returns 0 if blocks of this length
/// test it already.
double held_out_time_ahead(const CalibrationProblems& problems, double block_length);

}  // namespace tandem
