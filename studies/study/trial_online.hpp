#pragma once

#include <atomic>

#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// Fixed-lag smoothing of a scenario line by line: errors of the newest state at each keyframe, and into `result` how
/// it went. `window`: s. Throws Error on options that cannot work.
std::vector<KeyframeError> newest_errors(const Scenario& scenario, const TrackingOptions& options, double window,
                                         const std::atomic<bool>* stop, TrialResult& result);

}  // namespace tandem
