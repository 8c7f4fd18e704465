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

/// How the updates of an online estimate went, all together.
struct UpdateSums {
  int updates = 0, converged = 0, iterations = 0;
  double seconds = 0;

  void add(const OnlineUpdate& update);
};
/// As metrics and status of a trial.
void add_updates(const UpdateSums& sums, std::size_t keyframes, bool stopped, TrialResult& result);

/// The newest state of each keyframe, as it was known then.
struct NewestStates {
  std::vector<Keyframe> keyframes;
  std::vector<SE3> chaser;
  std::vector<TargetState> target;
  /// Where the target will be in so many seconds, seen from where the chaser is now [m].
  std::vector<std::array<std::optional<Vector<3>>, kAhead.size()>> ahead;
  UpdateSums sums;
};

/// Fixed-lag smoothing of a scenario line by line, in the order of the stamps, whose newest state is the window's or, of
/// the target, that of motion hypotheses. `window`: s. Throws Error on options that cannot work.
NewestStates newest_states(const Scenario& scenario, const TrackingOptions& options, double window,
                           bool hypotheses = false, const std::atomic<bool>* stop = nullptr);
/// Of a textbook filter, from the dead-reckoned chaser, in place of any smoothing. A fix counts from when it comes, as of
/// when it was valid: the filter is run again from there. Throws Error where sensors do not give positions.
NewestStates filtered_states(const Scenario& scenario, const TrackingOptions& options, ConstantVelocityFilter filter);

/// The errors of either, as the settings have it, and, into `result`, how it went and those of predictions.
std::vector<KeyframeError> newest_errors(const Scenario& scenario, const TrackingOptions& options,
                                         const TrialSettings& settings, const std::atomic<bool>* stop,
                                         TrialResult& result);

}  // namespace tandem
