#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/track_smoother.hpp>
#include <tandem/problem/tracking/tracking_start.hpp>
#include <tandem/residuals/direction.hpp>

namespace tandem {
namespace {

using detail::PositionFix;
using detail::SmoothedTrack;

/// Orientations are taken from pose measurements up to this many keyframe intervals away.
constexpr double kNearIntervals = 5;

/// Calls f(sensor, measurement, keyframe) for all that a problem may use.
template <class F>
void each_measurement(const TrackingData& data, const std::vector<Keyframe>& keyframes, F f) {
  for (const TargetSensor& sensor : data.sensors)
    for (const Measurement& m : sensor.measurements)
      if (const auto k = m.held_out ? std::nullopt : keyframe_at(keyframes, sensor.valid_at(m))) f(sensor, m, *k);
}

constexpr std::size_t kVoters = 9;                      // pose measurements that vote on one
constexpr double kTravelVote = 0.5;                     // of a direction of travel, against 1 of a measurement
constexpr double kDisagreement = std::numbers::pi / 4;  // rad

struct OrientationFix {
  double t;  // s
  SO3 rotation;
  SO3 travel{};  // along the smoothed track
};

/// Level, and facing where it goes.
SO3 along(const Vector<3>& velocity) { return SO3::Exp({0, 0, std::atan2(velocity.y(), velocity.x())}); }

double angle_between(const SO3& a, const SO3& b) { return (a.inverse() * b).Log().norm(); }

/// The fixes that agree with their neighbourhood's L1 medoid: of the nearest nine within `near`, the one with the least
/// sum of angles to the others and, at half weight, to their directions of travel. Half, so that travel decides between
/// equal parties but does not outvote measurements of a target that drifts or goes astern.
std::vector<OrientationFix> agreeing(const std::vector<OrientationFix>& fixes, double near) {
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
               kTravelVote * angle_between(fixes[a].rotation, fixes[b].travel);
      if (sum < least) {
        least = sum;
        medoid = a;
      }
    }
    if (angle_between(fixes[i].rotation, fixes[medoid].rotation) <= kDisagreement) kept.push_back(fixes[i]);
  }
  return kept;
}

std::vector<OrientationFix> measured_orientations(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                                  const std::vector<SE3>& chaser) {
  std::vector<OrientationFix> fixes;
  each_measurement(data, keyframes, [&](const TargetSensor& sensor, const Measurement& m, std::size_t k) {
    if (!sensor.type->has(measured::rotation)) return;
    fixes.push_back({keyframes[k].t, chaser[k].rotation() * sensor.pose_in_chaser(m).rotation()});
  });
  std::stable_sort(fixes.begin(), fixes.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
  return fixes;
}

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

/// Mean variance along the three axes of what the sensor sees at a range [m²].
double variance(const TargetSensor& sensor, bool planar, double range) {
  if (sensor.type->has(measured::range)) {
    const double across = range * sensor.sigma.tail(sensor.sigma.size() - 1).norm();
    return (sensor.sigma[0] * sensor.sigma[0] + across * across) / double(sensor.sigma.size());
  }
  const int n = planar ? 2 : 3;
  return sensor.sigma.head(n).squaredNorm() / double(n);
}

/// What a fix may be off by beside its noise, for good or for a while [m²]: a marker's place on a target whose orientation is
/// not known, and an error that stays.
double unexplained(const TargetSensor& sensor, bool planar, double range) {
  const double lever = sensor.type->has(measured::rotation) ? 0 : sensor.marker.translation().squaredNorm();
  if (!sensor.error) return lever;
  const StayingError& error = *sensor.error;
  const double constants = range * std::hypot(error.scale, error.misalignment);
  if (!error.has_bias()) return lever + constants * constants;
  TargetSensor staying = sensor;
  staying.sigma = error.sigma;
  return lever + constants * constants + variance(staying, planar, range);
}

/// Measured positions of the target; `lever` is the marker's position at each keyframe, in the world from the target,
/// where that is known by now.
std::vector<PositionFix> measured_positions(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                            const std::vector<SE3>& chaser, const std::vector<SE3>* target = nullptr) {
  std::vector<PositionFix> fixes;
  each_measurement(data, keyframes, [&](const TargetSensor& sensor, const Measurement& m, std::size_t k) {
    const auto position = sensor.position_in_chaser(m);
    if (!position) return;
    Vector<3> lever = Vector<3>::Zero();
    if (target && !sensor.type->has(measured::rotation))
      lever = (*target)[k].rotation().act(sensor.marker.translation());
    fixes.push_back({k, chaser[k].act(*position) - lever, variance(sensor, data.planar, position->stableNorm()),
                     std::size_t(&sensor - data.sensors.data()), std::size_t(&m - sensor.measurements.data())});
  });
  std::stable_sort(fixes.begin(), fixes.end(), [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
  return fixes;
}

/// Without positions: x0 + v t that lies closest to all lines of sight, a linear problem (the pseudo-linear estimator).
/// It is drawn, with the weight of the bearings' noise, to a target on the first line of sight that goes
/// with the chaser: bearings of a chaser that does not manoeuvre would fit one in the sensor itself just as well.
SmoothedTrack along_bearings(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                             const std::vector<SE3>& chaser) {
  Matrix<6, 6> normal = Matrix<6, 6>::Zero();
  Vector<6> right = Vector<6>::Zero(), guess = Vector<6>::Zero();
  double range = 0, noise = 0;
  int ranges = 0;
  double seen = HUGE_VAL;               // first, s
  Vector<3> sight = Vector<3>::Zero();  // that time, world axes
  each_measurement(data, keyframes, [&](const TargetSensor& sensor, const Measurement& m, std::size_t k) {
    if (sensor.type->has(measured::range)) {
      range += m.range;
      ++ranges;
    }
    if (!sensor.type->has(measured::direction | measured::angles)) return;
    const SE3 eye = chaser[k] * sensor.mount;
    const Vector<3> u = eye.rotation().act(Direction<3>(m.azimuth, m.elevation).unit());
    const Matrix<3, 3> across = Matrix<3, 3>::Identity() - u * u.transpose();
    const double t = keyframes[k].t - keyframes.front().t;
    Matrix<3, 6> A;
    A << across, t * across;
    normal += A.transpose() * A;
    right += A.transpose() * eye.translation();
    noise += sensor.sigma.squaredNorm() / double(sensor.sigma.size());
    if (t >= seen) return;
    seen = t;
    guess.head<3>() = eye.translation();
    sight = u;
  });
  const double nominal = ranges ? range / ranges : 1.0, duration = keyframes.back().t - keyframes.front().t;
  Vector<6> line = Vector<6>::Zero();
  if (seen == HUGE_VAL) {  // ranges alone: ahead of the chaser, at rest
    line.head<3>() = chaser.front().act(Vector<3>(nominal, 0, 0));
  } else {
    if (duration > 0) guess.tail<3>() = (chaser.back().translation() - chaser.front().translation()) / duration;
    guess.head<3>() += nominal * sight - seen * guess.tail<3>();
    Vector<6> weight = Vector<6>::Constant(noise * nominal * nominal);
    if (duration > 0) weight.tail<3>() *= duration * duration;
    normal.diagonal() += weight;
    line = normal.ldlt().solve(right + weight.cwiseProduct(guess));
  }
  SmoothedTrack track;
  for (const Keyframe& k : keyframes) {
    track.position.push_back(line.head<3>() + (k.t - keyframes.front().t) * line.tail<3>());
    track.velocity.push_back(line.tail<3>());
  }
  return track;
}

/// Of the target along a straight line [m/√s], from whichever model's noise there is.
double travel_noise(const TrackingNoise& noise, bool planar) {
  for (const Eigen::VectorXd* sigma : {&noise.constant_twist, &noise.acceleration, &noise.constant_velocity})
    if (const double largest = sigma->head(planar ? 2 : 3).maxCoeff(); largest > 0) return largest;
  return 0;
}

/// Without those of them that are outliers.
std::vector<PositionFix> without(std::vector<PositionFix> fixes, const std::vector<PositionOutlier>& outliers) {
  std::erase_if(fixes, [&](const PositionFix& fix) {
    return std::any_of(outliers.begin(), outliers.end(),
                       [&](const PositionOutlier& o) { return o.sensor == fix.sensor && o.index == fix.index; });
  });
  return fixes;
}

/// A sensor that is less exact far away would make a position that is far off a vague one: as if seen no further than
/// three times the usual distance.
void judge_as_near(const TrackingData& data, const std::vector<SE3>& chaser, std::vector<PositionFix>& fixes) {
  std::vector<double> ranges;
  const auto range = [&](const PositionFix& fix) {
    return (fix.position - chaser[fix.keyframe].translation()).stableNorm();
  };
  for (const PositionFix& fix : fixes) ranges.push_back(range(fix));
  const auto middle = ranges.begin() + std::ptrdiff_t(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  for (PositionFix& fix : fixes) {
    const TargetSensor& sensor = data.sensors[fix.sensor];
    const double near = std::min(range(fix), 3 * *middle);
    fix.variance = variance(sensor, data.planar, near) + unexplained(sensor, data.planar, near);
  }
}

constexpr double kOutlying = 10;      // standard deviations
constexpr std::size_t kSnooped = 8;   // neighbours each way, of which one is taken out at a time
constexpr double kOfTheWorst = 1e-2;  // what is less outlying than this share of the worst may be for its sake
constexpr double kJudged = 1e-6;      // of a fix's variance: a residual of less says nothing, no other fix checks it
constexpr int kMostSnooping = 100;

/// Residuals of the fixes in standard deviations of their own.
std::vector<double> studentised(const std::vector<PositionFix>& fixes, const SmoothedTrack& track) {
  std::vector<double> sigmas;
  for (const PositionFix& fix : fixes) {
    const double variance = fix.variance - track.variance[fix.keyframe];
    const double residual = (fix.position - track.position[fix.keyframe]).stableNorm();
    sigmas.push_back(variance > kJudged * fix.variance ? residual / std::sqrt(variance) : 0.0);
  }
  return sigmas;
}

/// Takes the worst of each neighbourhood out of `fixes`; false when none is outlying.
bool snoop(const std::vector<Keyframe>& keyframes, double q, std::vector<PositionFix>& fixes,
           std::vector<PositionFix>& taken_out) {
  const std::vector<double> sigmas = studentised(fixes, smooth(keyframes, fixes, q));
  const double least = std::max(kOutlying, kOfTheWorst * *std::max_element(sigmas.begin(), sigmas.end()));
  std::vector<PositionFix> kept;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const auto from = sigmas.begin() + std::ptrdiff_t(i - std::min(i, kSnooped));
    const auto to = sigmas.begin() + std::ptrdiff_t(std::min(i + kSnooped + 1, sigmas.size()));
    const bool worst = sigmas[i] > least && std::max_element(from, to) == sigmas.begin() + std::ptrdiff_t(i);
    (worst ? taken_out : kept).push_back(fixes[i]);
  }
  std::swap(fixes, kept);
  return fixes.size() < kept.size() && fixes.size() > 1;
}

/// What a target's velocity may change by [m²/s³].
double travel_density(const TrackingData& data) {
  const double sigma = travel_noise(data.noise, data.planar);
  return sigma * sigma;
}

}  // namespace

std::vector<PositionOutlier> position_outliers(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                               const std::vector<SE3>& chaser) {
  std::vector<PositionFix> fixes = measured_positions(data, keyframes, chaser), taken_out;
  const double q = travel_density(data);
  if (fixes.size() < 3 || !(q > 0)) return {};  // of two that disagree none is the outlier; nor where any motion may be
  judge_as_near(data, chaser, fixes);
  for (int i = 0; i < kMostSnooping && snoop(keyframes, q, fixes, taken_out);) ++i;
  if (taken_out.empty()) return {};
  const SmoothedTrack track = smooth(keyframes, fixes, q);
  std::vector<PositionOutlier> outliers;
  for (const PositionFix& fix : taken_out) {
    const double distance = (fix.position - track.position[fix.keyframe]).stableNorm();
    const double sigmas = distance / std::sqrt(fix.variance + track.variance[fix.keyframe]);
    if (!(sigmas <= kOutlying)) outliers.push_back({fix.sensor, fix.index, sigmas});
  }
  std::sort(outliers.begin(), outliers.end(),
            [](const PositionOutlier& a, const PositionOutlier& b) { return a.sigmas > b.sigmas; });
  return outliers;
}

TargetStart initial_target(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                           const std::vector<SE3>& chaser, bool robust) {
  const auto measured = measured_orientations(data, keyframes, chaser);
  const double near = kNearIntervals * data.keyframe_interval;
  const auto start_on = [&](const SmoothedTrack& track) {
    std::vector<OrientationFix> orientations = measured;
    if (robust) {
      for (OrientationFix& fix : orientations) fix.travel = along(track.velocity[*keyframe_at(keyframes, fix.t)]);
      orientations = agreeing(orientations, near);
    }
    TargetStart start;
    start.velocity = track.velocity;
    for (std::size_t k = 0; k < keyframes.size(); ++k)
      start.pose.emplace_back(orientation_near(orientations, keyframes[k].t, near).value_or(along(track.velocity[k])),
                              track.position[k]);
    return start;
  };
  const auto outliers = robust ? position_outliers(data, keyframes, chaser) : std::vector<PositionOutlier>();
  const auto fixes = without(measured_positions(data, keyframes, chaser), outliers);
  if (fixes.empty()) return start_on(along_bearings(data, keyframes, chaser));
  const double q = travel_density(data);
  TargetStart start = start_on(smooth(keyframes, fixes, q));
  const bool levers = std::any_of(data.sensors.begin(), data.sensors.end(), [](const TargetSensor& sensor) {
    return !sensor.type->has(measured::rotation) && !sensor.marker.translation().isZero();
  });
  // A lever arm on the target needs its orientation, which is known only now.
  if (levers) {
    const auto levered = without(measured_positions(data, keyframes, chaser, &start.pose), outliers);
    start = start_on(smooth(keyframes, levered, q));
  }
  return start;
}

TargetStart straightened(const TargetStart& start, const std::vector<Keyframe>& keyframes) {
  Eigen::MatrixX2d times(keyframes.size(), 2);
  Eigen::MatrixX3d positions(keyframes.size(), 3);
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    times.row(Eigen::Index(k)) << 1.0, keyframes[k].t - keyframes.front().t;
    positions.row(Eigen::Index(k)) = start.pose[k].translation();
  }
  const Matrix<2, 2> normal = times.transpose() * times;
  const Matrix<2, 3> line = normal.ldlt().solve(times.transpose() * positions);
  const Vector<3> velocity = line.row(1);
  TargetStart straight;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    straight.pose.emplace_back(along(velocity), Vector<3>(times.row(Eigen::Index(k)) * line));
    straight.velocity.push_back(velocity);
  }
  return straight;
}

}  // namespace tandem
