#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <tandem/problem/quantile.hpp>
#include <tandem/problem/tracking/outliers.hpp>
#include <tandem/problem/tracking/position_fixes.hpp>
#include <tandem/residuals/direction.hpp>

namespace tandem {
namespace {

using detail::PositionFix;
using detail::SmoothedTrack;

constexpr double kOutlierSigmas = 10, kGrossSigmas = 100;
constexpr double kGrossAngle = std::numbers::pi / 4;  // rad; a robust loss would not suppress a larger error
// Neighbours of a range or direction: at most this many on either side, within this time.
constexpr std::size_t kNeighbours = 8;
constexpr double kNeighbourTime = 10;  // s
// A residual below this fraction of the largest may be caused by that outlier, so it is not removed yet.
constexpr double kFractionOfWorst = 1e-2;
// A residual with a variance below this fraction of the fix's variance is not testable: no other fix checks it.
constexpr double kMinRedundancy = 1e-6;
constexpr int kMaxSnooping = 100;     // iterations
constexpr double kReversalTime = 10;  // s; see turning_density()
constexpr double kSpeedInterval = 5;  // s; distance of the fixes that give a speed
constexpr std::string_view kSearching = "looking for outliers";

/// Returns the variance of the errors that the noise of a fix does not include [m²]. These are systematic errors and,
/// if the sensor does not measure the target's orientation, the lever arm of the marker.
double unmodelled_variance(const TargetSensor& sensor, bool planar, double range) {
  const double lever = sensor.type->has(measured::rotation) ? 0 : sensor.marker.translation().squaredNorm();
  if (!sensor.error) return lever;
  const SystematicError& error = *sensor.error;
  const double constants = range * std::hypot(error.scale_sigma, error.misalignment_sigma);
  if (!error.has_bias()) return lever + constants * constants;
  return lever + constants * constants + detail::position_variance(sensor.type, error.bias_sigma, planar, range);
}

/// Sets the variances of the fixes for the test. A range-dependent variance would accept a position that is far off.
/// Therefore, ranges above three times the median count as three times the median.
void set_test_variances(const TrackingData& data, const std::vector<SE3>& chaser, std::vector<PositionFix>& fixes) {
  std::vector<double> ranges;
  for (const PositionFix& fix : fixes)
    ranges.push_back((fix.position - chaser[fix.keyframe].translation()).stableNorm());
  const double most = 3 * detail::median(ranges);
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const TargetSensor& sensor = data.sensors[fixes[i].sensor];
    const double near = std::min(ranges[i], most);
    fixes[i].variance = detail::position_variance(sensor.type, sensor.sigma, data.planar, near) +
                        unmodelled_variance(sensor, data.planar, near);
  }
}

/// Returns the acceleration density of a target with the median speed that reverses its velocity every 10 s [m²/s³].
double turning_density(const std::vector<Keyframe>& keyframes, const std::vector<PositionFix>& fixes) {
  std::vector<double> speeds;
  for (std::size_t from = 0, to = 0; from < fixes.size(); ++from) {
    const auto dt = [&] { return keyframes[fixes[to].keyframe].t - keyframes[fixes[from].keyframe].t; };
    while (to + 1 < fixes.size() && dt() < kSpeedInterval) ++to;
    if (dt() > 0) speeds.push_back((fixes[to].position - fixes[from].position).stableNorm() / dt());
  }
  if (speeds.empty()) return 0;
  const double change = 2 * detail::median(speeds);
  return change * change / kReversalTime;
}

/// Returns the residuals of the fixes, divided by the standard deviations of these residuals.
std::vector<double> studentised(const std::vector<PositionFix>& fixes, const SmoothedTrack& track) {
  std::vector<double> sigmas;
  for (const PositionFix& fix : fixes) {
    const double variance = fix.variance - track.variance[fix.keyframe];
    const double residual = (fix.position - track.position[fix.keyframe]).stableNorm();
    sigmas.push_back(variance > kMinRedundancy * fix.variance ? residual / std::sqrt(variance) : 0.0);
  }
  return sigmas;
}

/// Moves the worst outlier of each neighbourhood from `fixes` to `removed`. Returns false if there is none.
bool snoop(const std::vector<Keyframe>& keyframes, double q, std::vector<PositionFix>& fixes,
           std::vector<PositionFix>& removed) {
  const std::vector<double> sigmas = studentised(fixes, smooth(keyframes, fixes, q));
  const double limit = std::max(kOutlierSigmas, kFractionOfWorst * *std::max_element(sigmas.begin(), sigmas.end()));
  std::vector<PositionFix> kept;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const auto from = sigmas.begin() + std::ptrdiff_t(i - std::min(i, kNeighbours));
    const auto to = sigmas.begin() + std::ptrdiff_t(std::min(i + kNeighbours + 1, sigmas.size()));
    const bool worst = sigmas[i] > limit && std::max_element(from, to) == sigmas.begin() + std::ptrdiff_t(i);
    (worst ? removed : kept).push_back(fixes[i]);
  }
  std::swap(fixes, kept);
  return fixes.size() < kept.size() && fixes.size() > 1;
}

class OutlierSearch {
 public:
  OutlierSearch(const TrackingData& data, const std::vector<Keyframe>& keyframes, const std::vector<SE3>& chaser,
                const Stop& stop)
      : data_(data), keyframes_(keyframes), chaser_(chaser), stop_(stop) {}

  std::vector<Outlier> run() {
    for (const TargetSensor& sensor : data_.sensors) worst_.emplace_back(sensor.measurements.size());
    search_positions();
    const std::vector<detail::UsableMeasurement> usable = detail::usable_measurements(data_, keyframes_);
    for (std::size_t s = 0; s < data_.sensors.size(); ++s) search_others(s, usable);
    std::vector<Outlier> found;
    for (const auto& sensor : worst_)
      for (const std::optional<Outlier>& outlier : sensor)
        if (outlier) found.push_back(*outlier);
    std::stable_sort(found.begin(), found.end(),
                     [](const Outlier& a, const Outlier& b) { return a.sigmas > b.sigmas; });
    return found;
  }

 private:
  /// Records an outlier if `deviation` is too large. `scale` is the standard deviation of the difference from the
  /// expected value, `noise` that of the measurement alone.
  void test(std::size_t sensor, std::size_t index, double deviation, double scale, double noise, bool is_angle) {
    const double sigmas = std::isnan(deviation) ? HUGE_VAL : deviation / scale;
    if (sigmas <= kOutlierSigmas) return;
    const bool gross = !(deviation <= kGrossSigmas * noise) || (is_angle && deviation > kGrossAngle);
    std::optional<Outlier>& worst = worst_[sensor][index];
    if (!worst)
      worst = Outlier{sensor, index, sigmas, gross};
    else
      worst = Outlier{sensor, index, std::max(worst->sigmas, sigmas), worst->gross || gross};
  }

  void search_positions() {
    std::vector<PositionFix> fixes = detail::measured_positions(data_, keyframes_, chaser_), removed;
    const double stiff = detail::target_acceleration_density(data_);
    // If only two fixes disagree, it is unknown which one is wrong. Without motion noise, the motion has no limit.
    if (fixes.size() < 3 || !(stiff > 0)) return;
    set_test_variances(data_, chaser_, fixes);
    const double q = stiff + turning_density(keyframes_, fixes);
    for (int i = 0; i < kMaxSnooping && snoop(keyframes_, q, fixes, removed); ++i) stop_.check(kSearching);
    track_ = smooth(keyframes_, fixes, q);
    for (const PositionFix& fix : removed) {
      const double distance = (fix.position - track_->position[fix.keyframe]).stableNorm();
      const double scale = std::sqrt(fix.variance + track_->variance[fix.keyframe]);
      test(fix.sensor, fix.index, distance, scale, scale, false);
      if (worst_[fix.sensor][fix.index]) test_direction(fix.sensor, fix.index, fix.keyframe);
    }
  }

  /// Returns the measured direction in the world, or nullopt.
  std::optional<Vector<3>> direction(std::size_t sensor, std::size_t index, std::size_t keyframe) const {
    const TargetSensor& s = data_.sensors[sensor];
    const Measurement& m = s.measurements[index];
    if (!s.type->has(measured::direction | measured::angles)) return {};
    return (chaser_[keyframe] * s.mount).rotation().act(Direction<3>(m.azimuth, m.elevation).unit());
  }
  /// Returns the standard deviation of the range or of the direction, including the bias.
  double noise(const TargetSensor& sensor, bool range) const {
    const Eigen::Index first = range || !sensor.type->has(measured::range) ? 0 : 1, n = range || data_.planar ? 1 : 2;
    const double bias =
        sensor.error && sensor.error->has_bias() ? sensor.error->bias_sigma.segment(first, n).maxCoeff() : 0;
    return std::hypot(sensor.sigma.segment(first, n).maxCoeff(), bias);
  }

  /// Tests a direction or a range against the track.
  void test_direction(std::size_t sensor, std::size_t index, std::size_t keyframe) {
    const auto measured = direction(sensor, index, keyframe);
    if (!measured) return;
    const auto [range, sigma] = expected_range(sensor, keyframe);
    if (!(range > 0)) return;
    const Vector<3> expected = (track_->position[keyframe] - sensor_position(sensor, keyframe)) / range;
    const double deviation = std::atan2(measured->cross(expected).norm(), measured->dot(expected));
    const TargetSensor& s = data_.sensors[sensor];
    const double of_noise = std::hypot(noise(s, false), s.error ? s.error->misalignment_sigma : 0);
    test(sensor, index, deviation, std::hypot(of_noise, sigma / range), of_noise, true);
  }
  void test_range(std::size_t sensor, std::size_t index, std::size_t keyframe) {
    const auto [range, sigma] = expected_range(sensor, keyframe);
    const TargetSensor& s = data_.sensors[sensor];
    const double of_noise = std::hypot(noise(s, true), s.error ? s.error->scale_sigma * range : 0);
    test(sensor, index, std::abs(s.measurements[index].range - range), std::hypot(of_noise, sigma), of_noise, false);
  }
  Vector<3> sensor_position(std::size_t sensor, std::size_t keyframe) const {
    return (chaser_[keyframe] * data_.sensors[sensor].mount).translation();
  }
  /// Returns the range to the track and its standard deviation [m].
  std::pair<double, double> expected_range(std::size_t sensor, std::size_t keyframe) const {
    const double range = (track_->position[keyframe] - sensor_position(sensor, keyframe)).norm();
    const double lever = data_.sensors[sensor].marker.translation().squaredNorm();
    return {range, std::sqrt(track_->variance[keyframe] + lever)};
  }

  /// Tests the measurements of a sensor that measures only ranges or only directions.
  void search_others(std::size_t s, const std::vector<detail::UsableMeasurement>& usable) {
    const TargetSensor& sensor = data_.sensors[s];
    if (sensor.type->has(measured::position)) return;
    const bool range = sensor.type->has(measured::range),
               turn = sensor.type->has(measured::direction | measured::angles);
    if (range == turn) return;
    std::vector<detail::UsableMeasurement> own;
    for (const auto& m : usable)
      if (m.sensor == s) own.push_back(m);
    std::stable_sort(own.begin(), own.end(), [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
    std::vector<Vector<3>> values;
    for (const auto& m : own) {
      values.push_back(range ? Vector<3>(sensor.measurements[m.index].range, 0, 0)
                             : *direction(s, m.index, m.keyframe));
      if (track_) range ? test_range(s, m.index, m.keyframe) : test_direction(s, m.index, m.keyframe);
    }
    for (std::size_t i = 0; i < own.size(); ++i) {
      stop_.check(kSearching);
      const auto [deviation, scale] = from_neighbours(own, values, i);
      const double of_noise = noise(sensor, range);  // neighbours share the constant errors
      if (scale) test(s, own[i].index, deviation, std::max(*scale, of_noise), of_noise, turn);
    }
  }
  /// Returns the distance of value i from its neighbours' medoid, and the scale: 1.48 times their median distance from
  /// the medoid, which estimates a standard deviation. With too few neighbours, there is no scale. Angles are chords.
  std::pair<double, std::optional<double>> from_neighbours(const std::vector<detail::UsableMeasurement>& own,
                                                           const std::vector<Vector<3>>& values, std::size_t i) const {
    constexpr std::size_t kMinNeighbours = 5;
    const auto far = [&](std::size_t a) {
      return std::abs(keyframes_[own[a].keyframe].t - keyframes_[own[i].keyframe].t) > kNeighbourTime;
    };
    std::size_t from = i - std::min(i, kNeighbours), to = std::min(i + kNeighbours + 1, values.size());
    while (far(from)) ++from;
    while (far(to - 1)) --to;
    if (to - from < kMinNeighbours) return {};
    std::size_t medoid = from;
    double least = HUGE_VAL;
    for (std::size_t a = from; a < to; ++a) {
      double sum = 0;
      for (std::size_t b = from; b < to; ++b) sum += (values[a] - values[b]).stableNorm();
      if (sum < least) {
        least = sum;
        medoid = a;
      }
    }
    std::vector<double> distances;
    for (std::size_t a = from; a < to; ++a) distances.push_back((values[a] - values[medoid]).stableNorm());
    return {distances[i - from], 1.48 * detail::median(distances)};
  }

  const TrackingData& data_;
  const std::vector<Keyframe>& keyframes_;
  const std::vector<SE3>& chaser_;
  const Stop& stop_;
  std::vector<std::vector<std::optional<Outlier>>> worst_;  // by [sensor][index]
  std::optional<SmoothedTrack> track_;                      // from positions without outliers
};

}  // namespace

std::vector<Outlier> outliers(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                              const std::vector<SE3>& chaser, const Stop& stop) {
  for (const TargetSensor& sensor : data.sensors) {  // the problem builder reports a wrong number of sigmas
    const int n = rows(sensor.type, data.planar);
    if (sensor.sigma.size() != n || (sensor.error && sensor.error->has_bias() && sensor.error->bias_sigma.size() != n))
      return {};
  }
  return OutlierSearch(data, keyframes, chaser, stop).run();
}

std::vector<std::vector<bool>> outlier_mask(const TrackingData& data, const std::vector<Outlier>& outliers,
                                            bool gross) {
  std::vector<std::vector<bool>> marks;
  for (const TargetSensor& sensor : data.sensors) marks.emplace_back(sensor.measurements.size(), false);
  for (const Outlier& outlier : outliers) marks[outlier.sensor][outlier.index] = outlier.gross || !gross;
  return marks;
}

}  // namespace tandem
