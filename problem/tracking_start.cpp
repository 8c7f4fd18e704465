#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking_start.hpp>

namespace tandem {
namespace {

constexpr double kSameInstant = 1e-3;  // s
/// Orientations are taken from pose measurements up to this many keyframe intervals away.
constexpr double kNearIntervals = 5;

/// Position and velocity of a point over the keyframes.
struct SmoothedTrack {
  std::vector<Vector<3>> position, velocity;  // m, m/s
};
struct PositionFix {
  std::size_t keyframe;
  Vector<3> position;  // m, world
  double variance;     // m²
};

/// Kalman filter and Rauch-Tung-Striebel smoother of white noise on acceleration with density q [m²/s³]. All three
/// axes share one 2 × 2 covariance, since the fixes are taken as isotropic.
SmoothedTrack smooth(const std::vector<Keyframe>& keyframes, const std::vector<PositionFix>& fixes, double q) {
  using State = Matrix<2, 3>;  // rows: position, velocity
  const std::size_t n = keyframes.size();
  std::vector<State> predicted(n), mean(n);
  std::vector<Matrix<2, 2>> predicted_cov(n), cov(n);
  const auto transition = [&](std::size_t k) {
    const double dt = keyframes[k].t - keyframes[k - 1].t;
    return Matrix<2, 2>{{1, dt}, {0, 1}};
  };
  auto fix = fixes.begin();
  for (std::size_t k = 0; k < n; ++k) {
    if (k == 0) {
      predicted[k].setZero();
      predicted[k].row(0) = fixes.front().position;
      predicted_cov[k] = Vector<2>(1e8, 1e4).asDiagonal();
    } else {
      const double dt = keyframes[k].t - keyframes[k - 1].t;
      const Matrix<2, 2> F = transition(k);
      predicted[k] = F * mean[k - 1];
      predicted_cov[k] =
          F * cov[k - 1] * F.transpose() + q * Matrix<2, 2>{{dt * dt * dt / 3, dt * dt / 2}, {dt * dt / 2, dt}};
    }
    mean[k] = predicted[k];
    cov[k] = predicted_cov[k];
    for (; fix != fixes.end() && fix->keyframe == k; ++fix) {
      const Vector<2> gain = cov[k].col(0) / (cov[k](0, 0) + fix->variance);
      mean[k] += gain * (fix->position.transpose() - mean[k].row(0));
      cov[k] -= gain * cov[k].row(0).eval();
    }
  }
  for (std::size_t k = n - 1; k-- > 0;) {
    const Matrix<2, 2> gain = cov[k] * transition(k + 1).transpose() * predicted_cov[k + 1].inverse();
    mean[k] += gain * (mean[k + 1] - predicted[k + 1]);
  }
  SmoothedTrack track;
  for (const State& x : mean) {
    track.position.push_back(x.row(0));
    track.velocity.push_back(x.row(1));
  }
  return track;
}

struct OrientationFix {
  double t;  // s
  SO3 rotation;
};

/// Orientation at time t from the two fixes around it, as far as they are near.
std::optional<SO3> orientation_near(const std::vector<OrientationFix>& fixes, double t, double near) {
  const auto after = std::lower_bound(fixes.begin(), fixes.end(), t, [](const auto& f, double x) { return f.t < x; });
  const auto before = after == fixes.begin() ? fixes.end() : after - 1;
  const bool has_after = after != fixes.end() && after->t - t <= near;
  const bool has_before = before != fixes.end() && t - before->t <= near;
  if (has_after && has_before)
    return interpolate(before->rotation, after->rotation, (t - before->t) / (after->t - before->t));
  if (has_after) return after->rotation;
  if (has_before) return before->rotation;
  return std::nullopt;
}

template <class Sensors>
void collect_times(const Sensors& sensors, double first, double last, std::vector<double>& times) {
  for (const auto& sensor : sensors)
    for (const auto& m : sensor.measurements) {
      if (!(m.t >= first - kSameInstant && m.t <= last + kSameInstant))  // a NaN neither
        throw Error(sensor.name + ": the measurement at " + std::to_string(m.t) +
                    " s is outside the odometry's time span, " + std::to_string(first) + " to " + std::to_string(last) +
                    " s");
      times.push_back(m.t);
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

std::vector<Keyframe> make_keyframes(const TrackingData& data, std::size_t most) {
  if (data.odometry.size() < 2) throw Error("a tracking problem needs odometry: two poses or more");
  if (!(data.keyframe_interval > kSameInstant)) throw Error("keyframe_interval must be above 1 ms");
  for (std::size_t k = 0; k < data.odometry.size(); ++k)
    if (!std::isfinite(data.odometry[k].t) || (k > 0 && !(data.odometry[k].t > data.odometry[k - 1].t)))
      throw Error("the odometry's times must be finite and increase, which its pose " + std::to_string(k) + " breaks");
  const double first = data.odometry.front().t, last = data.odometry.back().t;
  std::vector<double> times;
  collect_times(data.position_sensors, first, last, times);
  collect_times(data.pose_sensors, first, last, times);
  if (times.empty()) throw Error("a tracking problem needs relative measurements: there are none");
  times.push_back(last);
  std::sort(times.begin(), times.end());

  std::vector<Keyframe> keyframes;
  const auto add = [&](double t) { keyframes.push_back({t, KeyframeType::gated, {}, {}}); };
  add(first);
  for (const double t : times) {
    while (t - keyframes.back().t > data.keyframe_interval + kSameInstant)
      add(keyframes.back().t + data.keyframe_interval);
    if (t - keyframes.back().t >= kSameInstant) add(t);
  }
  if (most > 0 && keyframes.size() > most) keyframes.resize(most);

  for (const auto& sensor : data.position_sensors)
    for (const auto& m : sensor.measurements)
      if (const auto k = keyframe_at(keyframes, m.t)) {
        keyframes[*k].type = KeyframeType::usbl;
        keyframes[*k].measured_position = sensor.mount.act(m.value);
      }
  for (const auto& sensor : data.pose_sensors)
    for (const auto& m : sensor.measurements)
      if (const auto k = keyframe_at(keyframes, m.t)) {
        const SE3 body = sensor.mount * m.value * sensor.marker.inverse();
        keyframes[*k].type = KeyframeType::optical;
        keyframes[*k].measured_position = body.translation();
        keyframes[*k].measured_rotation = body.rotation();
      }
  if (std::none_of(keyframes.begin(), keyframes.end(),
                   [](const Keyframe& k) { return k.measured_position.has_value(); }))
    throw Error("no measurement falls into the first " + std::to_string(most) + " keyframes: ask for more of them");
  return keyframes;
}

std::vector<SE3> odometry_at(const std::vector<Stamped<SE3>>& odometry, const std::vector<Keyframe>& keyframes) {
  std::vector<SE3> poses;
  for (const Keyframe& k : keyframes) poses.push_back(pose_at(odometry, k.t).value());
  return poses;
}

std::vector<SE3> initial_target(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                const std::vector<SE3>& chaser) {
  std::vector<PositionFix> fixes;
  std::vector<OrientationFix> orientations;
  for (const auto& sensor : data.position_sensors)
    for (const auto& m : sensor.measurements)
      if (const auto k = keyframe_at(keyframes, m.t))
        fixes.push_back({*k, (chaser[*k] * sensor.mount).act(m.value), sensor.sigma.squaredNorm() / 3});
  for (const auto& sensor : data.pose_sensors)
    for (const auto& m : sensor.measurements)
      if (const auto k = keyframe_at(keyframes, m.t)) {
        const SE3 target = chaser[*k] * sensor.mount * m.value * sensor.marker.inverse();
        fixes.push_back({*k, target.translation(), sensor.sigma.head<3>().squaredNorm() / 3});
        orientations.push_back({keyframes[*k].t, target.rotation()});
      }
  std::stable_sort(fixes.begin(), fixes.end(), [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
  std::stable_sort(orientations.begin(), orientations.end(), [](const auto& a, const auto& b) { return a.t < b.t; });

  const double sigma = data.noise.constant_twist.head<3>().maxCoeff();
  const SmoothedTrack track = smooth(keyframes, fixes, sigma * sigma);
  std::vector<SE3> target;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const Vector<3>& v = track.velocity[k];
    const SO3 along = SO3::Exp({0, 0, std::atan2(v.y(), v.x())});
    const auto measured = orientation_near(orientations, keyframes[k].t, kNearIntervals * data.keyframe_interval);
    target.emplace_back(measured.value_or(along), track.position[k]);
  }
  return target;
}

}  // namespace tandem
