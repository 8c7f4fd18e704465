#pragma once

#include <tandem/studies/calibration/calibration_problem.hpp>

namespace tandem {

/// Returns the number of measurements of the target that contradict the others, for a problem solved with robust
/// losses: gross outliers, and measurements whose residual is larger than ten standard deviations. If a sensor's median
/// residual is larger than its stated noise explains, standard deviations are scaled by it. Sensors without a robust
/// loss have none.
int count_contradicting_measurements(CalibrationProblem& problem);

}  // namespace tandem
