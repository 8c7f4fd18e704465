#include <algorithm>

#include <fmt/format.h>

#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/studies/study/trial_online.hpp>

namespace tandem {
namespace {

constexpr int kIterations = 12;  // of an update, as of `tandem track`

/// A line of a scenario, in the order in which it comes: as stamped, odometry first.
struct OnlineLine {
  double t;
  std::optional<std::size_t> sensor;  ///< none: odometry
  std::size_t index;
};

std::vector<OnlineLine> lines_of(const TrackingData& data) {
  std::vector<OnlineLine> lines;
  for (std::size_t i = 0; i < data.odometry.size(); ++i) lines.push_back({data.odometry[i].t, {}, i});
  for (std::size_t s = 0; s < data.sensors.size(); ++s)
    for (std::size_t i = 0; i < data.sensors[s].measurements.size(); ++i)
      lines.push_back({data.sensors[s].measurements[i].t, s, i});
  std::stable_sort(lines.begin(), lines.end(), [](const OnlineLine& a, const OnlineLine& b) { return a.t < b.t; });
  return lines;
}

}  // namespace

NewestStates newest_states(const Scenario& scenario, const TrackingOptions& options, double window,
                           const std::atomic<bool>* stop) {
  OnlineOptions online;
  online.tracking = options;
  online.lag.window = window;
  online.lag.max_iterations = kIterations;
  online.lag.stop = stop;
  OnlineEstimator estimator(scenario.data, {}, online);

  const std::vector<Keyframe> offline = make_keyframes(scenario.data);
  NewestStates newest;
  estimator.on_update = [&](const OnlineUpdate& update) {
    ++newest.updates;
    newest.converged += update.summary.converged();
    newest.iterations += update.summary.iterations;
    newest.seconds += update.seconds;
    const auto k = keyframe_at(offline, update.t);
    const auto state = estimator.target();
    if (!k || !state) return;
    if (!newest.keyframes.empty() && offline[*k].t <= newest.keyframes.back().t) {  // more has come of that instant
      if (offline[*k].t < newest.keyframes.back().t) return;
      newest.keyframes.pop_back();
      newest.chaser.pop_back();
      newest.target.pop_back();
    }
    newest.keyframes.push_back(offline[*k]);
    newest.chaser.push_back(estimator.chaser().pose);
    newest.target.push_back(*state);
  };
  for (const OnlineLine& line : lines_of(scenario.data)) {
    if (stop && *stop) break;
    if (line.sensor)
      estimator.add_target(*line.sensor, scenario.data.sensors[*line.sensor].measurements[line.index]);
    else
      estimator.add_odometry(scenario.data.odometry[line.index]);
  }
  estimator.finish();
  return newest;
}

std::vector<KeyframeError> newest_errors(const Scenario& scenario, const TrackingOptions& options, double window,
                                         const std::atomic<bool>* stop, TrialResult& result) {
  const NewestStates newest = newest_states(scenario, options, window, stop);
  result.set("keyframes", double(newest.keyframes.size()));
  result.set("iterations", newest.iterations);
  result.set("solve_s", newest.seconds);
  result.status = name(Status::converged);
  if (newest.converged < newest.updates)
    result.message =
        fmt::format("{} of {} updates did not converge", newest.updates - newest.converged, newest.updates);
  return keyframe_errors(scenario, newest.keyframes, newest.chaser, newest.target);
}

}  // namespace tandem
