#pragma once

#include <atomic>

#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// The newest state of each keyframe, as fixed-lag smoothing knew it then.
struct NewestStates {
  std::vector<Keyframe> keyframes;
  std::vector<SE3> chaser;
  std::vector<TargetState> target;
  int updates = 0, converged = 0, iterations = 0;
  double seconds = 0;  ///< of all updates
};

/// Fixed-lag smoothing of a scenario line by line, in the order of the stamps. `window`: s. Throws Error on options that
/// cannot work.
NewestStates newest_states(const Scenario& scenario, const TrackingOptions& options, double window,
                           const std::atomic<bool>* stop = nullptr);

/// Its errors and, into `result`, how it went.
std::vector<KeyframeError> newest_errors(const Scenario& scenario, const TrackingOptions& options, double window,
                                         const std::atomic<bool>* stop, TrialResult& result);

}  // namespace tandem
