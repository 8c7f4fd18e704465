#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/orientation_guess.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/position_fixes.hpp>

namespace tandem::detail {
namespace {

constexpr std::size_t kVoters = 9;                         // neighbours that an orientation is compared with
constexpr double kTravelVote = 0.5;                        // weight of a direction of travel, relative to a measurement
constexpr double kMaxDisagreement = std::numbers::pi / 4;  // rad
constexpr double kMinSpeedSigmas = 4;  // speed, in standard deviations, above which its direction is known

double angle_between(const SO3& a, const SO3& b) { return (a.inverse() * b).Log().norm(); }

/// Returns the orientation at time t from the fixes before and after it that are within `near` [s], or nullopt.
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

bool has_course(const SmoothedTrack& track, std::size_t k) {
  return track.velocity[k].head<2>().squaredNorm() > kMinSpeedSigmas * kMinSpeedSigmas * track.velocity_variance[k];
}

/// Returns whether the nearest fixes on both sides of time t show a target that goes astern.
bool goes_astern(const std::vector<Keyframe>& keyframes, const SmoothedTrack& track,
                 const std::vector<OrientationFix>& fixes, double t) {
  const auto after = std::lower_bound(fixes.begin(), fixes.end(), t, [](const auto& f, double x) { return f.t < x; });
  const auto first = after - std::min<std::ptrdiff_t>(after - fixes.begin(), kVoters);
  const auto last = after + std::min<std::ptrdiff_t>(fixes.end() - after, kVoters);
  double ahead = 0;
  for (auto fix = first; fix != last; ++fix)
    if (const auto k = keyframe_at(keyframes, fix->t); k && has_course(track, *k))
      ahead += (fix->rotation.matrix() * Vector<3>::UnitX()).head<2>().dot(track.velocity[*k].head<2>().normalized());
  return ahead < 0;
}

}  // namespace

SO3 along(const Vector<3>& velocity) { return SO3::Exp({0, 0, std::atan2(velocity.y(), velocity.x())}); }

std::vector<OrientationFix> measured_orientations(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                                  const std::vector<SE3>& chaser) {
  std::vector<OrientationFix> fixes;
  for (const auto& [s, i, k] : usable_measurements(data, keyframes)) {
    const TargetSensor& sensor = data.sensors[s];
    if (sensor.type->has(measured::rotation))
      fixes.push_back(
          {keyframes[k].t, chaser[k].rotation() * sensor.pose_in_chaser(sensor.measurements[i]).rotation()});
  }
  std::stable_sort(fixes.begin(), fixes.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
  return fixes;
}

std::vector<OrientationFix> consistent_fixes(const std::vector<OrientationFix>& fixes,
                                             const std::vector<Keyframe>& keyframes, const SmoothedTrack& track,
                                             double near) {
  std::vector<SO3> travel;
  for (const OrientationFix& fix : fixes) travel.push_back(along(track.velocity[*keyframe_at(keyframes, fix.t)]));
  std::vector<OrientationFix> kept;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const auto away = [&](std::size_t j) { return j < fixes.size() ? std::abs(fixes[j].t - fixes[i].t) : HUGE_VAL; };
    std::size_t first = i, last = i;
    while (last - first + 1 < kVoters) {
      const double before = first > 0 ? away(first - 1) : HUGE_VAL, after = away(last + 1);
      if (std::min(before, after) > near) break;
      before <= after ? --first : ++last;
    }
    std::size_t medoid = i;
    double least = HUGE_VAL;
    for (std::size_t a = first; a <= last; ++a) {
      double sum = 0;
      for (std::size_t b = first; b <= last; ++b)
        sum += angle_between(fixes[a].rotation, fixes[b].rotation) +
               kTravelVote * angle_between(fixes[a].rotation, travel[b]);
      if (sum < least) {
        least = sum;
        medoid = a;
      }
    }
    if (angle_between(fixes[i].rotation, fixes[medoid].rotation) <= kMaxDisagreement) kept.push_back(fixes[i]);
  }
  return kept;
}

std::vector<SO3> guess_orientations(const std::vector<Keyframe>& keyframes, const SmoothedTrack& track,
                                    const std::vector<OrientationFix>& fixes, double near, const HeadingAxes& axes) {
  const std::size_t n = keyframes.size();
  std::vector<std::optional<SO3>> known(n);
  bool in_gap = false, astern = false;
  for (std::size_t k = 0; k < n; ++k) {
    known[k] = orientation_near(fixes, keyframes[k].t, near);
    const bool begins = !known[k] && !in_gap;
    in_gap = !known[k];
    if (begins) astern = goes_astern(keyframes, track, fixes, keyframes[k].t);
    if (in_gap && has_course(track, k)) known[k] = along(astern ? Vector<3>(-track.velocity[k]) : track.velocity[k]);
  }
  std::vector<SO3> found;
  std::size_t before = n, after = 0;  // keyframes of the nearest known orientations; n if there is none
  for (std::size_t k = 0; k < n; ++k) {
    if (known[k]) before = k;
    while (after < n && (after < k || !known[after])) ++after;
    if (known[k]) {
      found.push_back(*known[k]);
    } else if (before < n && after < n) {
      const double from = keyframes[before].t;
      found.push_back(
          interpolate(*known[before], *known[after], (keyframes[k].t - from) / (keyframes[after].t - from)));
    } else if (before < n || after < n) {
      found.push_back(*known[before < n ? before : after]);
    } else {
      found.push_back(along(track.position.back() - track.position.front()));
    }
  }
  for (std::size_t k = 0, end; k < n; k = end + 1) {
    for (end = k; end < n && !known[end];) ++end;
    if (end == k) continue;
    const double from = heading(found[k > 0 ? k - 1 : k]), to = heading(found[std::min(end, n - 1)]);
    const std::vector<double> headings = follow_axes(keyframes, track, axes, k, end, from, to);
    for (std::size_t i = 0; i < headings.size(); ++i)
      found[k + i] = SO3::Exp({0, 0, headings[i] - heading(found[k + i])}) * found[k + i];
  }
  return found;
}

}  // namespace tandem::detail
