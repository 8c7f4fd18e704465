#pragma once

#include <vector>

#include <tandem/studies/fit/likely_cause.hpp>
#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// Tries common mistakes if the navigation of `data` has a misfit or excludes the IMU: axes swapped or negated, the
/// sign of depths, headings that are negated or have another zero, quaternion order, a delay, a bias (lever arm), a
/// misalignment, a sensor without which the others agree. The sensor with the mistake need not be the one that misfits,
/// so all are tried.
///
/// Each trial navigates the part of the recording that contradicts the model most. Delays, biases and misalignments fit
/// other mistakes, too, so they are tried if no other mistake explains the part. Returns the changes that remove at
/// least a third of the part's cost, the best first, at most three. Stops early, without an error, at the solver's time
/// limit. Returns nothing, without a trial, if the fit is consistent.
std::vector<LikelyCause> likely_own_causes(const NavigationData& data, const NavigationOptions& options,
                                           const Navigation& result, const Frame& frame);

}  // namespace tandem
