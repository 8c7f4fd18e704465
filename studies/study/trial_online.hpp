#pragma once

#include <array>
#include <atomic>
#include <optional>
#include <vector>

#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/study/constant_velocity_filter.hpp>
#include <tandem/studies/study/trial_metrics.hpp>
#include <tandem/studies/study/trial_settings.hpp>

namespace tandem {

/// Totals over the updates of an online estimate.
struct UpdateSums {
  int updates = 0, converged = 0, iterations = 0;
  double seconds = 0;

  void add(const OnlineUpdate& update);
};
/// Sets status, message and solver metrics of a trial. `keyframes`: number of keyframes. `stopped`: the trial was
/// interrupted.
void add_updates(const UpdateSums& sums, std::size_t keyframes, bool stopped, TrialResult& result);

/// States of the keyframes, each as estimated when it was the newest one.
struct NewestStates {
  std::vector<Keyframe> keyframes;
  std::vector<SE3> chaser;
  std::vector<TargetState> target;
  /// Predicted target position at the horizons kAhead, in the chaser's current body frame [m].
  std::vector<std::array<std::optional<Vector<3>>, kAhead.size()>> ahead;
  UpdateSums sums;
};

/// Runs fixed-lag smoothing on a scenario in the order of the time stamps. The newest target state comes from the
/// window or, with `hypotheses`, from motion hypotheses. `window`: s. Throws Error if the options are invalid.
NewestStates newest_states(const Scenario& scenario, const TrackingOptions& options, double window,
                           bool hypotheses = false, const std::atomic<bool>* stop = nullptr);
/// Runs the baseline filter on fixes from the dead-reckoned chaser. A delayed fix is used when it arrives, at the time
/// at which it was valid: the filter restarts from there. Throws Error if a sensor does not measure positions.
NewestStates filtered_states(const Scenario& scenario, const TrackingOptions& options, ConstantVelocityFilter filter);

/// Runs the method of settings.newest and returns the errors of the newest states. Adds solver metrics and prediction
/// errors to `result`.
std::vector<KeyframeError> newest_errors(const Scenario& scenario, const TrackingOptions& options,
                                         const TrialSettings& settings, const std::atomic<bool>* stop,
                                         TrialResult& result);

}  // namespace tandem
