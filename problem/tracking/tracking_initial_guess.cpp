#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <tandem/problem/tracking/orientation_guess.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/position_fixes.hpp>
#include <tandem/problem/tracking/tracking_initial_guess.hpp>
#include <tandem/residuals/direction.hpp>

namespace tandem {
namespace {

using detail::SmoothedTrack;
using Mask = std::vector<std::vector<bool>>;  // by [sensor][index]

/// Maximum distance of a pose measurement that gives the orientation, in keyframe intervals.
constexpr double kNearIntervals = 5;

/// Returns the track x0 + v t with the least distance to all lines of sight (pseudo-linear estimator), for data without
/// positions. A weak prior, weighted with the bearings' noise, puts the target on the first line of sight and moves it
/// with the chaser. Without a prior, a target in the sensor itself would fit if the chaser does not manoeuvre.
SmoothedTrack track_from_bearings(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                  const std::vector<SE3>& chaser, const Mask& skip) {
  Matrix<6, 6> normal = Matrix<6, 6>::Zero();
  Vector<6> right = Vector<6>::Zero(), guess = Vector<6>::Zero();
  double range = 0, noise = 0;
  int ranges = 0;
  double first_seen = HUGE_VAL;         // s
  Vector<3> sight = Vector<3>::Zero();  // first direction, in the world
  for (const auto& [s, i, k] : detail::usable_measurements(data, keyframes, skip)) {
    const TargetSensor& sensor = data.sensors[s];
    const Measurement& m = sensor.measurements[i];
    if (sensor.type->has(measured::range)) {
      range += m.range;
      ++ranges;
    }
    if (!sensor.type->has(measured::direction | measured::angles)) continue;
    const SE3 eye = chaser[k] * sensor.mount;  // sensor in the world
    const Vector<3> u = eye.rotation().act(Direction<3>(m.azimuth, m.elevation).unit());
    const Matrix<3, 3> across = Matrix<3, 3>::Identity() - u * u.transpose();
    const double t = keyframes[k].t - keyframes.front().t;
    Matrix<3, 6> A;
    A << across, t * across;
    normal += A.transpose() * A;
    right += A.transpose() * eye.translation();
    noise += sensor.sigma.squaredNorm() / double(sensor.sigma.size());
    if (t >= first_seen) continue;
    first_seen = t;
    guess.head<3>() = eye.translation();
    sight = u;
  }
  const double nominal = ranges ? range / ranges : 1.0, duration = keyframes.back().t - keyframes.front().t;
  Vector<6> line = Vector<6>::Zero();
  if (first_seen == HUGE_VAL) {  // only ranges
    line.head<3>() = chaser.front().act(Vector<3>(nominal, 0, 0));
  } else {
    if (duration > 0) guess.tail<3>() = (chaser.back().translation() - chaser.front().translation()) / duration;
    guess.head<3>() += nominal * sight - first_seen * guess.tail<3>();
    Vector<6> weight = Vector<6>::Constant(noise * nominal * nominal);
    if (duration > 0) weight.tail<3>() *= duration * duration;
    normal.diagonal() += weight;
    line = normal.ldlt().solve(right + weight.cwiseProduct(guess));
  }
  SmoothedTrack track;
  for (const Keyframe& k : keyframes) {
    track.position.push_back(line.head<3>() + (k.t - keyframes.front().t) * line.tail<3>());
    track.velocity.push_back(line.tail<3>());
    track.velocity_variance.push_back(0);
  }
  return track;
}

}  // namespace

TargetGuess initial_target_guess(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                 const std::vector<SE3>& chaser, const TrackingOptions& options, const Stop& stop) {
  const bool robust = options.robust_initial_guess;
  const auto measured = detail::measured_orientations(data, keyframes, chaser);
  const double near = kNearIntervals * data.keyframe_interval;
  const auto guess_from = [&](const SmoothedTrack& track) {
    stop.check("computing the initial guess");
    const auto orientations = detail::guess_orientations(
        keyframes, track, robust ? detail::consistent_fixes(measured, keyframes, track, near) : measured, near,
        detail::heading_axes(keyframes, track, data.noise, options));
    TargetGuess guess;
    guess.velocity = track.velocity;
    for (std::size_t k = 0; k < keyframes.size(); ++k) guess.pose.emplace_back(orientations[k], track.position[k]);
    return guess;
  };
  const std::vector<Outlier> found = robust ? outliers(data, keyframes, chaser, stop) : std::vector<Outlier>();
  const Mask skip = outlier_mask(data, found);
  const auto fixes = detail::measured_positions(data, keyframes, chaser, skip);
  const double q = detail::target_acceleration_density(data);
  TargetGuess guess =
      guess_from(fixes.empty() ? track_from_bearings(data, keyframes, chaser, skip) : smooth(keyframes, fixes, q));
  const bool levers = std::any_of(data.sensors.begin(), data.sensors.end(), [](const TargetSensor& sensor) {
    return !sensor.type->has(measured::rotation) && !sensor.marker.translation().isZero();
  });
  // Lever arms on the target need its orientation, which the first pass provides.
  if (levers && !fixes.empty())
    guess = guess_from(smooth(keyframes, detail::measured_positions(data, keyframes, chaser, skip, &guess.pose), q));
  guess.outliers = found;
  return guess;
}

TargetGuess straight_line_guess(const TargetGuess& guess, const std::vector<Keyframe>& keyframes) {
  Eigen::MatrixX2d times(keyframes.size(), 2);
  Eigen::MatrixX3d positions(keyframes.size(), 3);
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    times.row(Eigen::Index(k)) << 1.0, keyframes[k].t - keyframes.front().t;
    positions.row(Eigen::Index(k)) = guess.pose[k].translation();
  }
  const Matrix<2, 2> normal = times.transpose() * times;
  const Matrix<2, 3> line = normal.ldlt().solve(times.transpose() * positions);
  const Vector<3> velocity = line.row(1);
  TargetGuess straight;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    straight.pose.emplace_back(detail::along(velocity), Vector<3>(times.row(Eigen::Index(k)) * line));
    straight.velocity.push_back(velocity);
  }
  return straight;
}

}  // namespace tandem
