#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/ego_track.hpp>

namespace tandem {

EgoState EgoTrack::at(double t) const {
  const auto after = std::lower_bound(states.begin(), states.end(), t,
                                      [](const Stamped<EgoState>& x, double time) { return x.t < time; });
  if (after == states.begin()) return states.front().value;
  if (after == states.end()) return states.back().value;
  const Stamped<EgoState>& before = *(after - 1);
  const double s = (t - before.t) / (after->t - before.t);
  const EgoState &a = before.value, &b = after->value;
  return {interpolate(a.pose, b.pose, s), a.velocity + s * (b.velocity - a.velocity), a.bias + s * (b.bias - a.bias)};
}

std::vector<double> EgoTrack::required_keyframe_times() const {
  std::vector<double> times;
  std::optional<ImuRecord> imu;
  if (data.imu) imu = record_of(*data.imu);
  for (std::size_t k = 1; k < states.size(); ++k) {
    if (imu && imu->covers(states[k - 1].t, states[k].t)) continue;
    if (times.empty() || times.back() < states[k - 1].t) times.push_back(states[k - 1].t);
    times.push_back(states[k].t);
  }
  return times;
}

namespace detail {

EgoTrackBuild::EgoTrackBuild(const EgoTrack& track, TrackingProblem& out)
    : track_(track),
      out_(out),
      chain_(out.problem, track.data, track.options),
      events_(in_time_order(track.data.sensors)),
      event_(events_.cbegin()) {
  if (track.states.size() < 2) throw BadInputError("EgoTrack::states, the initial guess, needs at least two states");
  if (track.data.imu)
    for (const ImuSample& sample : track.data.imu->samples) chain_.add(sample);
  out.num_discarded_ego.assign(track.data.sensors.size(), 0);
}

Variable<SE3> EgoTrackBuild::add(std::size_t k) {
  const double t = out_.keyframes[k].t;
  const EgoState guess = track_.at(t);
  out_.ego.push_back(k == 0 ? chain_.start(t, track_.start.state, track_.start.sigmas, guess)
                            : chain_.extend(t, guess));
  const bool last = k + 1 == out_.keyframes.size();
  const double until = last ? t + kSameInstant : out_.keyframes[k + 1].t - kSameInstant;
  for (; event_ != events_.cend() && event_->t <= until; ++event_) {
    if (chain_.can_attach(event_->t)) {
      const EgoMeasurement& m = track_.data.sensors[event_->sensor].measurements[event_->index];
      out_.ego_measurements.push_back(chain_.attach(event_->sensor, m, event_->t));
    } else {
      ++out_.num_discarded_ego[event_->sensor];
    }
  }
  if (last) {
    out_.constants = chain_.constants();
    out_.dvl_scale = chain_.dvl_scale();
    out_.splits = chain_.splits();
  }
  return out_.ego.back().pose;
}

}  // namespace detail

}  // namespace tandem
