#pragma once

#include <string>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/online/track_health.hpp>

namespace tandem {

/// Returns the options that make constraints on the motion of the target hard, as "--roll-pitch hard and --surge".
/// Empty if there are none.
std::string hard_options(const TrackingOptions& target);

/// Returns a sentence about a reset. It names the hard constraints if they may be the reason.
std::string reset_notice(const TrackReset& reset, const TrackingOptions& target);

/// Returns a sentence about a shift of a sensor's innovations. `components`: names of its components; `others`: names
/// of the sensors that agree with the estimate, or an empty string.
std::string shift_notice(const std::string& sensor, const std::vector<std::string>& components,
                         const InnovationShift& shift, const std::string& others);

}  // namespace tandem
