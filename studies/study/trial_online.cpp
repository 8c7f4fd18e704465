#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/target_fix.hpp>
#include <tandem/studies/study/trial_online.hpp>

namespace tandem {
namespace {

constexpr int kIterations = 12;  // per update, as in `tandem track`

/// An odometry pose or a measurement, in the order of arrival: by time stamp, odometry first.
struct Arrival {
  double t;
  std::optional<std::size_t> sensor;  ///< nullopt: odometry
  std::size_t index;
};

std::vector<Arrival> arrivals_of(const TrackingData& data) {
  std::vector<Arrival> lines;
  for (std::size_t i = 0; i < data.odometry.size(); ++i) lines.push_back({data.odometry[i].t, {}, i});
  for (std::size_t s = 0; s < data.sensors.size(); ++s)
    for (std::size_t i = 0; i < data.sensors[s].measurements.size(); ++i)
      lines.push_back({data.sensors[s].measurements[i].t, s, i});
  std::stable_sort(lines.begin(), lines.end(), [](const Arrival& a, const Arrival& b) { return a.t < b.t; });
  return lines;
}

}  // namespace

void UpdateSums::add(const OnlineUpdate& update) {
  ++updates;
  converged += update.summary.converged();
  iterations += update.summary.iterations;
  seconds += update.seconds;
}

void add_updates(const UpdateSums& sums, std::size_t keyframes, bool stopped, TrialResult& result) {
  result.status = name(stopped ? Status::interrupted : Status::converged);
  if (sums.converged < sums.updates)
    result.message = fmt::format("{} of {} updates did not converge", sums.updates - sums.converged, sums.updates);
  result.set("keyframes", double(keyframes));
  result.set("iterations", sums.iterations);
  result.set("solve_s", sums.seconds);
}

NewestStates newest_states(const Scenario& scenario, const TrackingOptions& options, double window, bool hypotheses,
                           const std::atomic<bool>* stop) {
  OnlineOptions online;
  online.tracking = options;
  online.hypotheses = hypotheses;
  online.lag.window = window;
  online.lag.max_iterations = kIterations;
  online.lag.stop = stop;
  online.reset.max_gap = HUGE_VAL;  // no suspension, so that all methods have errors at the same keyframes
  OnlineEstimator estimator(scenario.data, {}, online);

  const std::vector<Keyframe> offline = make_keyframes(scenario.data);
  NewestStates newest;
  estimator.on_update = [&](const OnlineUpdate& update) {
    newest.sums.add(update);
    const auto k = keyframe_at(offline, update.t);
    const auto state = estimator.target();
    if (!k || !state) return;
    if (!newest.keyframes.empty() && offline[*k].t <= newest.keyframes.back().t) {  // another update at the same time
      if (offline[*k].t < newest.keyframes.back().t) return;
      newest.keyframes.pop_back();
      newest.chaser.pop_back();
      newest.target.pop_back();
      newest.ahead.pop_back();
    }
    newest.keyframes.push_back(offline[*k]);
    newest.chaser.push_back(estimator.chaser().pose);
    newest.target.push_back(*state);
    auto& ahead = newest.ahead.emplace_back();
    for (std::size_t i = 0; i < kAhead.size(); ++i)
      if (const auto seen = estimator.relative_target(kAhead[i])) ahead[i] = seen->position;
  };
  for (const Arrival& line : arrivals_of(scenario.data)) {
    if (stop && *stop) break;
    if (line.sensor)
      estimator.add_target(*line.sensor, scenario.data.sensors[*line.sensor].measurements[line.index]);
    else
      estimator.add_odometry(scenario.data.odometry[line.index]);
  }
  estimator.finish();
  return newest;
}

NewestStates filtered_states(const Scenario& scenario, const TrackingOptions& options, ConstantVelocityFilter filter) {
  const TrackingData& data = scenario.data;
  if (const std::string why = why_hypotheses_unsupported(data, !data.ego); !why.empty())
    throw Error("newest: kalman is not possible: " + why);
  const std::vector<Keyframe> keyframes = make_keyframes(data);
  std::vector<std::vector<Arrival>> fixes(keyframes.size());  // fixes that were valid at each keyframe
  for (std::size_t s = 0; s < data.sensors.size(); ++s)
    for (std::size_t i = 0; i < data.sensors[s].measurements.size(); ++i)
      if (const auto k = keyframe_at(keyframes, data.sensors[s].valid_at(data.sensors[s].measurements[i])))
        fixes[*k].push_back({data.sensors[s].measurements[i].t, s, i});
  // Advances a filter to keyframe k with the fixes that arrived by `now`.
  const auto advance = [&](ConstantVelocityFilter& by, std::size_t k, double now) {
    const auto chaser = pose_at(data.odometry, keyframes[k].t);
    if (!chaser) return;
    if (by.started()) by.predict(keyframes[k].t);
    for (const Arrival& line : fixes[k]) {
      if (line.t > now + kSameInstant) continue;
      const TargetSensor& sensor = data.sensors[*line.sensor];
      const TargetFix fix = detail::target_fix(sensor, sensor.measurements[line.index], *chaser, options);
      by.update(keyframes[k].t, fix.position, fix.covariance);
    }
  };

  NewestStates newest;
  std::size_t settled = 0;  // number of keyframes that `filter` includes; all their fixes have arrived
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const double now = keyframes[k].t;
    const auto all_here = [&](const Arrival& line) { return line.t <= now + kSameInstant; };
    while (settled <= k && std::all_of(fixes[settled].begin(), fixes[settled].end(), all_here))
      advance(filter, settled++, now);
    ConstantVelocityFilter by = filter;  // provisional: delayed fixes may still change it
    for (std::size_t j = settled; j <= k; ++j) advance(by, j, now);
    const auto chaser = pose_at(data.odometry, now);
    if (!chaser || !by.started()) continue;
    newest.keyframes.push_back(keyframes[k]);
    newest.chaser.push_back(*chaser);
    newest.target.emplace_back(by.position());
    auto& ahead = newest.ahead.emplace_back();
    for (std::size_t i = 0; i < kAhead.size(); ++i) ahead[i] = chaser->inverse().act(by.position(kAhead[i]));
  }
  return newest;
}

std::vector<KeyframeError> newest_errors(const Scenario& scenario, const TrackingOptions& options,
                                         const TrialSettings& settings, const std::atomic<bool>* stop,
                                         TrialResult& result) {
  const NewestStateMethod& by = settings.newest;
  const NewestStates newest =
      by.kind == NewestStateMethod::Kind::kalman
          ? filtered_states(scenario, options, ConstantVelocityFilter(by.acceleration, by.velocity_time))
          : newest_states(scenario, options, settings.window, by.kind == NewestStateMethod::Kind::hypotheses, stop);
  add_updates(newest.sums, newest.keyframes.size(), stop && *stop, result);
  for (std::size_t i = 0; i < kAhead.size(); ++i) {
    Moments errors;
    for (std::size_t k = 0; k < newest.keyframes.size(); ++k) {
      const double t = newest.keyframes[k].t;
      const auto from = pose_at(scenario.truth_chaser, t);
      const auto there = pose_at(scenario.truth_target, t + kAhead[i]);
      if (from && there && newest.ahead[k][i])
        errors.add((*newest.ahead[k][i] - from->inverse().act(there->translation())).norm());
    }
    result.set_mean(ahead_metric(kAhead[i]), errors);
  }
  return keyframe_errors(scenario, newest.keyframes, newest.chaser, newest.target);
}

}  // namespace tandem
