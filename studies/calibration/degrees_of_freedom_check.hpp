#pragma once

#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/calibration/model_parameters.hpp>
#include <tandem/studies/calibration/noise_parameters.hpp>

namespace tandem {

/// Throws Error if degrees of freedom cannot be calibrated because the estimated states absorb too much of the sensor's
/// noise. The limit is a leverage of 1/3, beyond which the first correction for the tails (detail::TailTerm) is
/// inaccurate. In simulations, the degrees of freedom are biased by −1 % at a leverage of 0.1, −2 % at 0.2, −4 % at 1/3
/// and −10 % at 0.4. With hard constraints there is no correction (+24 % at 0.2), and the limit is 0.2. The problems
/// must be solved. Returns without a check after a stop.
void check_degrees_of_freedom(const CalibrationProblems& problems, const std::vector<ModelParameter>& parameters,
                              const Stop& stop);

}  // namespace tandem
