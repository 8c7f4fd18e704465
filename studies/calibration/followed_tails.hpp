#pragma once

#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/calibration/noise_parameters.hpp>
#include <tandem/studies/calibration/scenario_numbers.hpp>

namespace tandem {

/// Refuses degrees of freedom of sensors of whose noise the states follow more than a half: what is made of tails then is no
/// evidence (detail::TailTerm). In simulations they are right to 1 % up to a third, 7 % too few at a half. Of solved problems.
/// Throws Error, saying so; not once it is to stop.
void refuse_followed_tails(const CalibrationProblems& problems, const std::vector<ScenarioNumber>& numbers,
                           const Stop& stop);

}  // namespace tandem
