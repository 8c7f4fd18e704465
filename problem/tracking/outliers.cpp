#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <tandem/problem/median.hpp>
#include <tandem/problem/tracking/outliers.hpp>
#include <tandem/problem/tracking/position_fixes.hpp>
#include <tandem/residuals/direction.hpp>

namespace tandem {
namespace {

using detail::PositionFix;
using detail::SmoothedTrack;

constexpr double kOutlying = 10, kGross = 100;       // standard deviations
constexpr double kGrossTurn = std::numbers::pi / 4;  // rad; a loss would not make a direction that is outlying small
constexpr std::size_t kNeighbours = 8;               // each way,
constexpr double kNear = 10;                         // s, of ranges and directions
constexpr double kOfTheWorst = 1e-2;  // what is less outlying than this share of the worst may be for its sake
constexpr double kJudged = 1e-6;      // of a fix's variance: a residual of less says nothing, no other fix checks it
constexpr int kMostSnooping = 100;
constexpr double kTurnsRound = 10;  // s
constexpr double kApart = 5;        // s, of fixes that tell a speed
constexpr std::string_view kSearching = "looking for outliers";

/// What a fix may be off by beside its noise, for good or for a while [m²]: a marker's place on a target whose orientation is
/// not known, and an error that stays.
double unexplained(const TargetSensor& sensor, bool planar, double range) {
  const double lever = sensor.type->has(measured::rotation) ? 0 : sensor.marker.translation().squaredNorm();
  if (!sensor.error) return lever;
  const StayingError& error = *sensor.error;
  const double constants = range * std::hypot(error.scale, error.misalignment);
  if (!error.has_bias()) return lever + constants * constants;
  return lever + constants * constants + detail::position_variance(sensor.type, error.sigma, planar, range);
}

/// A sensor that is less exact far away would make a position that is far off a vague one: as if seen no further than
/// three times the usual distance.
void judge_as_near(const TrackingData& data, const std::vector<SE3>& chaser, std::vector<PositionFix>& fixes) {
  std::vector<double> ranges;
  for (const PositionFix& fix : fixes)
    ranges.push_back((fix.position - chaser[fix.keyframe].translation()).stableNorm());
  const double most = 3 * detail::median(ranges);
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const TargetSensor& sensor = data.sensors[fixes[i].sensor];
    const double near = std::min(ranges[i], most);
    fixes[i].variance = detail::position_variance(sensor.type, sensor.sigma, data.planar, near) +
                        unexplained(sensor, data.planar, near);
  }
}

/// What the velocity of a target of the usual speed changes by that turns round, and back, and so on [m²/s³].
double turning_density(const std::vector<Keyframe>& keyframes, const std::vector<PositionFix>& fixes) {
  std::vector<double> speeds;
  for (std::size_t from = 0, to = 0; from < fixes.size(); ++from) {
    const auto dt = [&] { return keyframes[fixes[to].keyframe].t - keyframes[fixes[from].keyframe].t; };
    while (to + 1 < fixes.size() && dt() < kApart) ++to;
    if (dt() > 0) speeds.push_back((fixes[to].position - fixes[from].position).stableNorm() / dt());
  }
  if (speeds.empty()) return 0;
  const double change = 2 * detail::median(speeds);
  return change * change / kTurnsRound;
}

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
    const auto from = sigmas.begin() + std::ptrdiff_t(i - std::min(i, kNeighbours));
    const auto to = sigmas.begin() + std::ptrdiff_t(std::min(i + kNeighbours + 1, sigmas.size()));
    const bool worst = sigmas[i] > least && std::max_element(from, to) == sigmas.begin() + std::ptrdiff_t(i);
    (worst ? taken_out : kept).push_back(fixes[i]);
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
  /// A value `off` by so much, of a scale (one standard deviation of what is expected) and a noise alone.
  void judge(std::size_t sensor, std::size_t index, double off, double scale, double noise, bool is_angle) {
    const double sigmas = std::isnan(off) ? HUGE_VAL : off / scale;
    if (sigmas <= kOutlying) return;
    const bool gross = !(off <= kGross * noise) || (is_angle && off > kGrossTurn);
    std::optional<Outlier>& worst = worst_[sensor][index];
    if (!worst)
      worst = Outlier{sensor, index, sigmas, gross};
    else
      worst = Outlier{sensor, index, std::max(worst->sigmas, sigmas), worst->gross || gross};
  }

  void search_positions() {
    std::vector<PositionFix> fixes = detail::measured_positions(data_, keyframes_, chaser_), taken_out;
    const double stiff = detail::travel_density(data_);
    if (fixes.size() < 3 || !(stiff > 0)) return;  // of two that disagree none is it; nor where any motion may be
    judge_as_near(data_, chaser_, fixes);
    const double q = stiff + turning_density(keyframes_, fixes);
    for (int i = 0; i < kMostSnooping && snoop(keyframes_, q, fixes, taken_out); ++i) stop_.check(kSearching);
    track_ = smooth(keyframes_, fixes, q);
    for (const PositionFix& fix : taken_out) {
      const double distance = (fix.position - track_->position[fix.keyframe]).stableNorm();
      const double scale = std::sqrt(fix.variance + track_->variance[fix.keyframe]);
      judge(fix.sensor, fix.index, distance, scale, scale, false);
      if (worst_[fix.sensor][fix.index]) judge_direction(fix.sensor, fix.index, fix.keyframe);
    }
  }

  /// Measured, in the world, where the sensor measures some.
  std::optional<Vector<3>> direction(std::size_t sensor, std::size_t index, std::size_t keyframe) const {
    const TargetSensor& s = data_.sensors[sensor];
    const Measurement& m = s.measurements[index];
    if (!s.type->has(measured::direction | measured::angles)) return {};
    return (chaser_[keyframe] * s.mount).rotation().act(Direction<3>(m.azimuth, m.elevation).unit());
  }
  /// Standard deviation of the range, or else of the direction, a bias included.
  double noise(const TargetSensor& sensor, bool range) const {
    const Eigen::Index first = range || !sensor.type->has(measured::range) ? 0 : 1, n = range || data_.planar ? 1 : 2;
    const double staying =
        sensor.error && sensor.error->has_bias() ? sensor.error->sigma.segment(first, n).maxCoeff() : 0;
    return std::hypot(sensor.sigma.segment(first, n).maxCoeff(), staying);
  }

  /// By the track.
  void judge_direction(std::size_t sensor, std::size_t index, std::size_t keyframe) {
    const auto measured = direction(sensor, index, keyframe);
    if (!measured) return;
    const auto [range, spread] = expected_range(sensor, keyframe);
    if (!(range > 0)) return;
    const Vector<3> expected = (track_->position[keyframe] - eye(sensor, keyframe)) / range;
    const double off = std::atan2(measured->cross(expected).norm(), measured->dot(expected));
    const TargetSensor& s = data_.sensors[sensor];
    const double of_noise = std::hypot(noise(s, false), s.error ? s.error->misalignment : 0);
    judge(sensor, index, off, std::hypot(of_noise, spread / range), of_noise, true);
  }
  void judge_range(std::size_t sensor, std::size_t index, std::size_t keyframe) {
    const auto [range, spread] = expected_range(sensor, keyframe);
    const TargetSensor& s = data_.sensors[sensor];
    const double of_noise = std::hypot(noise(s, true), s.error ? s.error->scale * range : 0);
    judge(sensor, index, std::abs(s.measurements[index].range - range), std::hypot(of_noise, spread), of_noise, false);
  }
  Vector<3> eye(std::size_t sensor, std::size_t keyframe) const {
    return (chaser_[keyframe] * data_.sensors[sensor].mount).translation();
  }
  /// And its standard deviation.
  std::pair<double, double> expected_range(std::size_t sensor, std::size_t keyframe) const {
    const double range = (track_->position[keyframe] - eye(sensor, keyframe)).norm();
    const double lever = data_.sensors[sensor].marker.translation().squaredNorm();
    return {range, std::sqrt(track_->variance[keyframe] + lever)};
  }

  /// Ranges and directions of a sensor that gives no positions.
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
      if (track_) range ? judge_range(s, m.index, m.keyframe) : judge_direction(s, m.index, m.keyframe);
    }
    for (std::size_t i = 0; i < own.size(); ++i) {
      stop_.check(kSearching);
      const auto [off, scale] = from_neighbours(own, values, i);
      const double of_noise = noise(sensor, range);  // constants are those of the neighbours, too
      if (scale) judge(s, own[i].index, off, std::max(*scale, of_noise), of_noise, turn);
    }
  }
  /// How far one is from its neighbours' medoid, and 1.48 times their own median distance from that, which is a standard
  /// deviation of what is normal; no scale where there are too few to tell. Chords serve for angles.
  std::pair<double, std::optional<double>> from_neighbours(const std::vector<detail::UsableMeasurement>& own,
                                                           const std::vector<Vector<3>>& values, std::size_t i) const {
    constexpr std::size_t kFew = 5;
    const auto far = [&](std::size_t a) {
      return std::abs(keyframes_[own[a].keyframe].t - keyframes_[own[i].keyframe].t) > kNear;
    };
    std::size_t from = i - std::min(i, kNeighbours), to = std::min(i + kNeighbours + 1, values.size());
    while (far(from)) ++from;
    while (far(to - 1)) --to;
    if (to - from < kFew) return {};
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
  std::vector<std::vector<std::optional<Outlier>>> worst_;  // of each measurement
  std::optional<SmoothedTrack> track_;                      // of positions without the outlying ones
};

}  // namespace

std::vector<Outlier> outliers(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                              const std::vector<SE3>& chaser, const Stop& stop) {
  for (const TargetSensor& sensor : data.sensors) {  // whose sigmas are not those of its rows: the builder says so
    const int n = rows(sensor.type, data.planar);
    if (sensor.sigma.size() != n || (sensor.error && sensor.error->has_bias() && sensor.error->sigma.size() != n))
      return {};
  }
  return OutlierSearch(data, keyframes, chaser, stop).run();
}

std::vector<std::vector<bool>> marked(const TrackingData& data, const std::vector<Outlier>& outliers, bool gross) {
  std::vector<std::vector<bool>> marks;
  for (const TargetSensor& sensor : data.sensors) marks.emplace_back(sensor.measurements.size(), false);
  for (const Outlier& outlier : outliers) marks[outlier.sensor][outlier.index] = outlier.gross || !gross;
  return marks;
}

}  // namespace tandem
