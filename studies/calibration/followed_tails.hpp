#pragma once

#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/calibration/noise_parameters.hpp>
#include <tandem/studies/calibration/scenario_numbers.hpp>

namespace tandem {

/// Refuses degrees of freedom of sensors of whose noise the states follow more than a third: the first term for their tails
/// (detail::TailTerm) is not enough then. In simulations they come out 1 % too few where states follow a tenth, 2 % a fifth, 4 % a
/// third, 10 % two fifths. Under hard constraints, where there is no such term (24 % too many at a fifth), more than a fifth. Of
/// solved problems. Throws Error, saying so; not once it is to stop.
void refuse_followed_tails(const CalibrationProblems& problems, const std::vector<ScenarioNumber>& numbers,
                           const Stop& stop);

}  // namespace tandem
