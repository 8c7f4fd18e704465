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

std::vector<KeyframeError> newest_errors(const Scenario& scenario, const TrackingOptions& options, double window,
                                         const std::atomic<bool>* stop, TrialResult& result) {
  OnlineOptions online;
  online.tracking = options;
  online.lag.window = window;
  online.lag.max_iterations = kIterations;
  online.lag.stop = stop;
  OnlineEstimator estimator(scenario.data, {}, online);

  const std::vector<Keyframe> offline = make_keyframes(scenario.data);
  std::vector<Keyframe> keyframes;
  std::vector<SE3> chaser;
  std::vector<TargetState> target;
  int iterations = 0, updates = 0, converged = 0;
  double seconds = 0;
  estimator.on_update = [&](const OnlineUpdate& update) {
    ++updates;
    converged += update.summary.converged();
    iterations += update.summary.iterations;
    seconds += update.seconds;
    const auto k = keyframe_at(offline, update.t);
    const auto state = estimator.target();
    if (!k || !state) return;
    if (!keyframes.empty() && offline[*k].t <= keyframes.back().t) {  // more has come of that instant
      if (offline[*k].t < keyframes.back().t) return;
      keyframes.pop_back();
      chaser.pop_back();
      target.pop_back();
    }
    keyframes.push_back(offline[*k]);
    chaser.push_back(estimator.chaser().pose);
    target.push_back(*state);
  };
  for (const OnlineLine& line : lines_of(scenario.data)) {
    if (stop && *stop) break;
    if (line.sensor)
      estimator.add_target(*line.sensor, scenario.data.sensors[*line.sensor].measurements[line.index]);
    else
      estimator.add_odometry(scenario.data.odometry[line.index]);
  }
  estimator.finish();
  result.set("keyframes", double(keyframes.size()));
  result.set("iterations", iterations);
  result.set("solve_s", seconds);
  result.status = name(Status::converged);
  if (converged < updates)
    result.message = fmt::format("{} of {} updates did not converge", updates - converged, updates);
  return keyframe_errors(scenario, keyframes, chaser, target);
}

}  // namespace tandem
