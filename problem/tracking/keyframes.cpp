#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/problem/tracking/keyframes.hpp>

namespace tandem {
namespace {

/// Times at which measurements were valid.
std::vector<double> measured_times(const TrackingData& data) {
  const double first = data.odometry.front().t, last = data.odometry.back().t;
  std::vector<double> times;
  for (const TargetSensor& sensor : data.sensors) {
    if (!(std::isfinite(sensor.delay) && sensor.delay >= 0))
      throw Error(sensor.name + ": a delay is zero or more seconds, not " + std::to_string(sensor.delay));
    for (const Measurement& m : sensor.measurements) {
      const double t = sensor.valid_at(m);
      if (data.ego) {  // which decides itself where the chaser's motion begins and ends
        if (t >= first - kSameInstant && t <= last + kSameInstant) times.push_back(t);
        continue;
      }
      if (!(m.t >= first - kSameInstant && m.t <= last + kSameInstant))  // a NaN neither
        throw Error(sensor.name + ": the measurement at " + std::to_string(m.t) +
                    " s is outside the odometry's time span, " + std::to_string(first) + " to " + std::to_string(last) +
                    " s");
      if (t >= first - kSameInstant) times.push_back(t);
    }
  }
  if (times.empty()) throw Error("a tracking problem needs relative measurements: there are none");
  return times;
}

/// Marks the keyframes with the best that was measured at them.
void mark(const TrackingData& data, std::vector<Keyframe>& keyframes) {
  for (const TargetSensor& sensor : data.sensors)
    for (const Measurement& m : sensor.measurements) {
      const auto k = keyframe_at(keyframes, sensor.valid_at(m));
      const auto position = sensor.position_in_chaser(m);
      if (!k || !position || m.held_out) continue;
      Keyframe& keyframe = keyframes[*k];
      if (sensor.type->has(measured::rotation)) {
        keyframe.type = KeyframeType::optical;
        keyframe.measured_position = position;
        keyframe.measured_rotation = sensor.pose_in_chaser(m).rotation();
      } else if (keyframe.type != KeyframeType::optical) {
        keyframe.type = KeyframeType::usbl;
        keyframe.measured_position = position;
      }
    }
}

}  // namespace

std::optional<std::size_t> keyframe_at(const std::vector<Keyframe>& keyframes, double t) {
  const auto after =
      std::lower_bound(keyframes.begin(), keyframes.end(), t, [](const Keyframe& k, double x) { return k.t < x; });
  auto nearest = after;
  if (after == keyframes.end() || (after != keyframes.begin() && t - (after - 1)->t < after->t - t)) --nearest;
  if (std::abs(nearest->t - t) > kSameInstant) return std::nullopt;
  return static_cast<std::size_t>(nearest - keyframes.begin());
}

std::optional<std::size_t> keyframe_until(const std::vector<Keyframe>& keyframes, double t) {
  if (const auto at = keyframe_at(keyframes, t)) return at;
  if (t < keyframes.front().t || t > keyframes.back().t) return {};
  const auto after =
      std::lower_bound(keyframes.begin(), keyframes.end(), t, [](const Keyframe& k, double x) { return k.t < x; });
  return static_cast<std::size_t>(after - keyframes.begin()) - 1;
}

std::vector<Keyframe> make_keyframes(const TrackingData& data, std::size_t most) {
  if (data.odometry.size() < 2) throw Error("a tracking problem needs odometry: two poses or more");
  if (!(data.keyframe_interval > kSameInstant)) throw Error("keyframe_interval must be above 1 ms");
  for (std::size_t k = 0; k < data.odometry.size(); ++k)
    if (!std::isfinite(data.odometry[k].t) || (k > 0 && !(data.odometry[k].t > data.odometry[k - 1].t)))
      throw Error("the odometry's times must be finite and increase, which its pose " + std::to_string(k) + " breaks");
  std::vector<double> times = measured_times(data);
  times.push_back(data.odometry.back().t);
  const double first_measured = *std::min_element(times.begin(), times.end());
  if (data.ego)
    for (const double t : data.ego->untied()) times.push_back(t);
  std::sort(times.begin(), times.end());

  std::vector<Keyframe> keyframes;
  const auto add = [&](double t) { keyframes.push_back({t, KeyframeType::gated, {}, {}}); };
  add(data.odometry.front().t);
  for (const double t : times) {
    while (t - keyframes.back().t > data.keyframe_interval + kSameInstant)
      add(keyframes.back().t + data.keyframe_interval);
    if (t - keyframes.back().t >= kSameInstant) add(t);
  }
  if (most > 0 && keyframes.size() > most) keyframes.resize(most);
  if (first_measured > keyframes.back().t + kSameInstant)
    throw Error("no measurement falls into the first " + std::to_string(most) + " keyframes: ask for more of them");
  mark(data, keyframes);
  return keyframes;
}

std::vector<SE3> odometry_at(const std::vector<Stamped<SE3>>& odometry, const std::vector<Keyframe>& keyframes) {
  std::vector<SE3> poses;
  for (const Keyframe& k : keyframes) poses.push_back(pose_at(odometry, k.t).value());
  return poses;
}

}  // namespace tandem
