#pragma once

#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/calibration/noise_parameters.hpp>
#include <tandem/studies/calibration/scenario_numbers.hpp>

namespace tandem {

/// Refuses degrees of freedom of sensors of whose noise the states follow more than a fifth: what Laplace's approximation makes
/// of tails is then no evidence. In simulations it finds 12 % too many where they follow a tenth, 24 % a fifth, 45 % a third. Of
/// solved problems. Throws Error, saying so; not once it is to stop.
void refuse_followed_tails(const CalibrationProblems& problems, const std::vector<ScenarioNumber>& numbers,
                           const Stop& stop);

}  // namespace tandem
