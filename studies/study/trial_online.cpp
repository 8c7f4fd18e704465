#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/target_fix.hpp>
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
  online.reset.max_gap = HUGE_VAL;  // as a filter, so that errors are of the same keyframes
  OnlineEstimator estimator(scenario.data, {}, online);

  const std::vector<Keyframe> offline = make_keyframes(scenario.data);
  NewestStates newest;
  estimator.on_update = [&](const OnlineUpdate& update) {
    newest.sums.add(update);
    const auto k = keyframe_at(offline, update.t);
    const auto state = estimator.target();
    if (!k || !state) return;
    if (!newest.keyframes.empty() && offline[*k].t <= newest.keyframes.back().t) {  // more has come of that instant
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

NewestStates filtered_states(const Scenario& scenario, const TrackingOptions& options, ConstantVelocityFilter filter) {
  const TrackingData& data = scenario.data;
  if (const std::string why = why_no_hypotheses(data, !data.ego); !why.empty())
    throw Error("a filter of positions cannot serve here: " + why);
  const std::vector<Keyframe> keyframes = make_keyframes(data);
  std::vector<std::vector<OnlineLine>> fixes(keyframes.size());  // by the keyframe at which they were valid
  for (std::size_t s = 0; s < data.sensors.size(); ++s)
    for (std::size_t i = 0; i < data.sensors[s].measurements.size(); ++i)
      if (const auto k = keyframe_at(keyframes, data.sensors[s].valid_at(data.sensors[s].measurements[i])))
        fixes[*k].push_back({data.sensors[s].measurements[i].t, s, i});
  // To keyframe k, by what has come by `now`.
  const auto advance = [&](ConstantVelocityFilter& by, std::size_t k, double now) {
    const auto chaser = pose_at(data.odometry, keyframes[k].t);
    if (!chaser) return;
    if (by.started()) by.predict(keyframes[k].t);
    for (const OnlineLine& line : fixes[k]) {
      if (line.t > now + kSameInstant) continue;
      const TargetSensor& sensor = data.sensors[*line.sensor];
      const TargetFix fix = detail::target_fix(sensor, sensor.measurements[line.index], *chaser, options);
      by.update(keyframes[k].t, fix.position, fix.covariance);
    }
  };

  NewestStates newest;
  std::size_t settled = 0;  // keyframes of which all fixes have come, and which `filter` has behind it
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const double now = keyframes[k].t;
    const auto all_here = [&](const OnlineLine& line) { return line.t <= now + kSameInstant; };
    while (settled <= k && std::all_of(fixes[settled].begin(), fixes[settled].end(), all_here))
      advance(filter, settled++, now);
    ConstantVelocityFilter by = filter;  // late ones change what was filtered after them
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
  const NewestBy& by = settings.newest;
  const NewestStates newest =
      by.kind == NewestBy::Kind::kalman
          ? filtered_states(scenario, options, ConstantVelocityFilter(by.acceleration, by.velocity_time))
          : newest_states(scenario, options, settings.window, by.kind == NewestBy::Kind::hypotheses, stop);
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
