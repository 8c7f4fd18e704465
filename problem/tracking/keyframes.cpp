#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/problem/tracking/keyframes.hpp>

namespace tandem {
namespace {

/// Returns the times of validity of all measurements within the odometry's time span.
std::vector<double> measured_times(const TrackingData& data) {
  const double first = data.odometry.front().t, last = data.odometry.back().t;
  std::vector<double> times;
  for (const TargetSensor& sensor : data.sensors) {
    if (!(std::isfinite(sensor.delay) && sensor.delay >= 0))
      throw BadInputError(sensor.name + ": the delay must be zero or positive, and finite, not " +
                          std::to_string(sensor.delay) + " s");
    for (const Measurement& m : sensor.measurements) {
      const double t = sensor.valid_at(m);
      if (data.ego) {
        if (t >= first - kSameInstant && t <= last + kSameInstant) times.push_back(t);
        continue;
      }
      if (!(m.t >= first - kSameInstant && m.t <= last + kSameInstant))  // also true for NaN
        throw BadInputError(sensor.name + ": the measurement at " + std::to_string(m.t) +
                            " s is outside the odometry's time span, " + std::to_string(first) + " to " +
                            std::to_string(last) + " s");
      if (t >= first - kSameInstant) times.push_back(t);
    }
  }
  if (times.empty())
    throw BadInputError("a tracking problem needs relative measurements of the target, but there are none");
  return times;
}

/// Sets the type of each keyframe from the best measurement at it.
void set_types(const TrackingData& data, std::vector<Keyframe>& keyframes) {
  for (const TargetSensor& sensor : data.sensors)
    for (const Measurement& m : sensor.measurements) {
      const auto k = keyframe_at(keyframes, sensor.valid_at(m));
      if (k && !m.held_out) update_type(keyframes[*k], sensor, m);
    }
}

}  // namespace

std::string_view name(KeyframeType type) {
  constexpr std::string_view names[] = {"position", "pose", "partial", "none"};
  return names[int(type)];
}

void update_type(Keyframe& keyframe, const TargetSensor& sensor, const Measurement& m) {
  const auto position = sensor.position_in_chaser(m);
  if (!position) {
    if (keyframe.type == KeyframeType::none) keyframe.type = KeyframeType::partial;
    return;
  }
  if (sensor.type->has(measured::rotation)) {
    keyframe = {keyframe.t, KeyframeType::pose, position, sensor.pose_in_chaser(m).rotation()};
  } else if (keyframe.type != KeyframeType::pose) {
    keyframe.type = KeyframeType::position;
    keyframe.measured_position = position;
  }
}

std::optional<std::size_t> keyframe_at(const std::vector<Keyframe>& keyframes, double t) {
  const auto after =
      std::lower_bound(keyframes.begin(), keyframes.end(), t, [](const Keyframe& k, double x) { return k.t < x; });
  auto nearest = after;
  if (after == keyframes.end() || (after != keyframes.begin() && t - (after - 1)->t < after->t - t)) --nearest;
  if (std::abs(nearest->t - t) > kSameInstant) return std::nullopt;
  return static_cast<std::size_t>(nearest - keyframes.begin());
}

std::optional<std::size_t> keyframe_at_or_before(const std::vector<Keyframe>& keyframes, double t) {
  if (const auto at = keyframe_at(keyframes, t)) return at;
  if (t < keyframes.front().t || t > keyframes.back().t) return {};
  const auto after =
      std::lower_bound(keyframes.begin(), keyframes.end(), t, [](const Keyframe& k, double x) { return k.t < x; });
  return static_cast<std::size_t>(after - keyframes.begin()) - 1;
}

std::vector<Keyframe> make_keyframes(const TrackingData& data, std::size_t max_count) {
  if (data.odometry.size() < 2) throw BadInputError("a tracking problem needs odometry with at least two poses");
  if (!(data.keyframe_interval > kSameInstant)) throw BadInputError("keyframe_interval must be above 1 ms");
  for (std::size_t k = 0; k < data.odometry.size(); ++k)
    if (!std::isfinite(data.odometry[k].t) || (k > 0 && !(data.odometry[k].t > data.odometry[k - 1].t)))
      throw BadInputError("odometry: the time of pose " + std::to_string(k) + " is not finite or does not increase");
  std::vector<double> times = measured_times(data);
  times.push_back(data.odometry.back().t);
  const double first_measured = *std::min_element(times.begin(), times.end());
  if (data.ego)
    for (const double t : data.ego->required_keyframe_times()) times.push_back(t);
  std::sort(times.begin(), times.end());

  std::vector<Keyframe> keyframes;
  const auto add = [&](double t) { keyframes.push_back({t, KeyframeType::none, {}, {}}); };
  add(data.odometry.front().t);
  for (const double t : times) {
    while (t - keyframes.back().t > data.keyframe_interval + kSameInstant)
      add(keyframes.back().t + data.keyframe_interval);
    if (t - keyframes.back().t >= kSameInstant) add(t);
  }
  if (max_count > 0 && keyframes.size() > max_count) keyframes.resize(max_count);
  if (first_measured > keyframes.back().t + kSameInstant)
    throw BadInputError("the first " + std::to_string(max_count) +
                        " keyframes contain no measurement; use more keyframes");
  set_types(data, keyframes);
  return keyframes;
}

std::vector<SE3> odometry_at(const std::vector<Stamped<SE3>>& odometry, const std::vector<Keyframe>& keyframes) {
  std::vector<SE3> poses;
  for (const Keyframe& k : keyframes) poses.push_back(pose_at(odometry, k.t).value());
  return poses;
}

}  // namespace tandem
