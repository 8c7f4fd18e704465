#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/studies/navigation/averaged_readings.hpp>

namespace tandem {
namespace {

constexpr double kMinPerKeyframe = 4;  // readings of a sensor that is averaged
constexpr std::size_t kMinJudged = 5;  // readings that can contradict one of them
constexpr double kStated = 0.9;        // quantile of the standard deviations that the sensor states
constexpr double kMaxScale = 1.5;      // largest standard deviation relative to the stated one
constexpr double kMedianPerSigma = 0.6745;
constexpr double kContradiction = 8;       // standard deviations
constexpr std::size_t kMaxReferences = 9;  // orientations that may be the origin of the rotation vectors

using Kind = NavigationFinding::Kind;

bool is_fast(const EgoSensor& sensor, double interval) {
  std::vector<double> times;
  for (const EgoMeasurement& m : sensor.measurements) times.push_back(m.t);
  return times.size() > 2 && kMinPerKeyframe * detail::median_step(times) <= interval + kSameInstant;
}

/// Returns the times of the keyframes between the first and the last reading [s].
std::vector<double> keyframe_times(const NavigationData& data, const std::vector<bool>& fast) {
  double first = HUGE_VAL, last = -HUGE_VAL;
  std::vector<double> fixed;
  for (std::size_t s = 0; s < data.sensors.size(); ++s) {
    const EgoSensor& sensor = data.sensors[s];
    if (sensor.measurements.empty()) continue;
    first = std::min(first, sensor.valid_at(sensor.measurements.front()));
    last = std::max(last, sensor.valid_at(sensor.measurements.back()));
    if (fast[s]) continue;
    for (const EgoMeasurement& m : sensor.measurements) fixed.push_back(sensor.valid_at(m));
  }
  std::erase_if(fixed, [&](double t) { return !(t > first && t < last); });
  fixed.push_back(last);
  std::sort(fixed.begin(), fixed.end());
  std::vector<double> times = {first};
  for (const double t : fixed) {
    const double from = times.back(), gap = t - from;
    const double parts = std::ceil((gap - kSameInstant) / data.keyframe_interval);
    for (double i = 1; i < parts; ++i) times.push_back(from + gap * i / parts);
    if (gap > kSameInstant) times.push_back(t);
  }
  return times;
}

/// Returns the orientation with the smallest sum of angles to the others.
SO3 typical_orientation(std::span<const EgoMeasurement> readings) {
  const std::size_t step = (readings.size() + kMaxReferences - 1) / kMaxReferences;
  SO3 best;
  double least = HUGE_VAL;
  for (std::size_t i = step / 2; i < readings.size(); i += step) {
    double sum = 0;
    for (const EgoMeasurement& m : readings) sum += minus(m.rotation, readings[i].rotation).norm();
    if (!(sum < least)) continue;
    least = sum;
    best = readings[i].rotation;
  }
  return best;
}

/// Straight line through readings of one sensor.
class Line {
 public:
  Line(const EgoSensor& sensor, std::span<const EgoMeasurement> readings) : sensor_(sensor) {
    const bool turned = sensor.type->reading == EgoReading::orientation;
    if (turned) origin_ = typical_orientation(readings);
    for (const EgoMeasurement& m : readings)
      points_.push_back({sensor.valid_at(m), turned ? minus(m.rotation, origin_) : m.value});
    fit();
  }

  /// Removes the readings that contradict the others, at most a third. Returns their times of validity.
  std::vector<double> remove_contradictions() {
    const std::size_t n = points_.size();
    std::vector<double> times, worst(n, 0);  // standard deviations
    if (n < kMinJudged) return times;
    for (int c = 0; c < 3; ++c) {
      const std::vector<double> off = distance_from_median_line(c);
      const double scale = std::max(sigma(c), detail::median(off) / kMedianPerSigma);
      for (std::size_t i = 0; i < n; ++i) worst[i] = std::max(worst[i], off[i] / scale);
    }
    if (3 * std::count_if(worst.begin(), worst.end(), [](double w) { return w > kContradiction; }) > std::ptrdiff_t(n))
      return times;
    std::vector<Point> kept;
    for (std::size_t i = 0; i < n; ++i)
      if (worst[i] > kContradiction)
        times.push_back(points_[i].t);
      else
        kept.push_back(points_[i]);
    points_ = std::move(kept);
    fit();
    return times;
  }

  /// Returns the reading at a time of validity.
  EgoMeasurement at(double t) const {
    EgoMeasurement m{t + sensor_.delay};
    const Vector<3> value = mean_ + (t - middle_) * slope_;
    if (sensor_.type->reading == EgoReading::orientation)
      m.rotation = plus(origin_, value);
    else
      m.value = value;
    return m;
  }
  /// Returns the standard deviation of at(t) relative to that of one reading.
  double scale(double t) const { return std::sqrt(leverage(t)); }

 private:
  struct Point {
    double t;
    Vector<3> value;
  };

  double leverage(double t) const {
    return 1 / double(points_.size()) + (spread_ > 0 ? (t - middle_) * (t - middle_) / spread_ : 0);
  }
  /// Returns the absolute distances of a component from a line whose slope and height are medians, so that a third of
  /// wrong readings does not move it.
  std::vector<double> distance_from_median_line(int c) const {
    const std::size_t half = points_.size() / 2;
    std::vector<double> slopes, off;
    for (std::size_t i = 0; i + half < points_.size(); ++i)
      slopes.push_back((points_[i + half].value[c] - points_[i].value[c]) / (points_[i + half].t - points_[i].t));
    const double slope = detail::median(std::move(slopes));
    for (const Point& p : points_) off.push_back(p.value[c] - slope * (p.t - middle_));
    const double height = detail::median(off);
    for (double& value : off) value = std::abs(value - height);
    return off;
  }
  double sigma(int component) const {
    return sensor_.sigma[std::min<Eigen::Index>(component, sensor_.sigma.size() - 1)];
  }

  void fit() {
    middle_ = spread_ = 0;
    mean_ = slope_ = Vector<3>::Zero();
    const double n = double(points_.size());
    for (const Point& p : points_) middle_ += (p.t - points_.front().t) / n, mean_ += p.value / n;
    middle_ += points_.front().t;
    for (const Point& p : points_) {
      spread_ += (p.t - middle_) * (p.t - middle_);
      slope_ += (p.t - middle_) * (p.value - mean_);
    }
    if (spread_ > 0) slope_ /= spread_;
  }

  const EgoSensor& sensor_;
  SO3 origin_{};
  std::vector<Point> points_;
  double middle_ = 0, spread_ = 0;  // s, s²
  Vector<3> mean_, slope_;
};

/// Averages of a sensor, and its rejected readings.
struct Averages {
  std::vector<EgoMeasurement> measurements;
  std::vector<double> scale;  // of the standard deviation of each
  NavigationFinding rejected;
};

void add_average(const EgoSensor& sensor, std::span<const EgoMeasurement> readings, double keyframe, double step,
                 Averages& out) {
  if (readings.size() == 1) {
    out.measurements.push_back(readings.front());
    out.scale.push_back(1);
    return;
  }
  Line line(sensor, readings);
  for (const double t : line.remove_contradictions()) {
    const double stamp = t + sensor.delay;
    out.rejected.from = out.rejected.count++ == 0 ? stamp : std::min(out.rejected.from, stamp);
    out.rejected.to = std::max(out.rejected.to, stamp);
  }
  // A line through few readings must not be extrapolated.
  const double beyond = readings.size() >= kMinJudged ? step : 0;
  const double first = sensor.valid_at(readings.front()), last = sensor.valid_at(readings.back());
  const double t = keyframe > first - beyond && keyframe < last + beyond ? keyframe : std::clamp(keyframe, first, last);
  out.measurements.push_back(line.at(t));
  out.scale.push_back(line.scale(t));
}

Averages average(const EgoSensor& sensor, const std::vector<double>& keyframes) {
  Averages result{{}, {}, {Kind::rejected, sensor.name}};
  std::vector<double> times;
  for (const EgoMeasurement& m : sensor.measurements) times.push_back(sensor.valid_at(m));
  const double step = detail::median_step(times);
  const std::span<const EgoMeasurement> all(sensor.measurements);
  std::size_t from = 0;
  for (std::size_t k = 0; k < keyframes.size() && from < times.size(); ++k) {
    const double until = k + 1 < keyframes.size() ? (keyframes[k] + keyframes[k + 1]) / 2 : HUGE_VAL;
    std::size_t to = from;
    while (to < times.size() && times[to] < until) ++to;
    if (to > from) add_average(sensor, all.subspan(from, to - from), keyframes[k], step, result);
    from = to;
  }
  return result;
}

/// Replaces the readings of a sensor. Returns the findings about them.
std::vector<NavigationFinding> replace_readings(EgoSensor& sensor, const std::vector<double>& keyframes,
                                                double interval) {
  Averages averages = average(sensor, keyframes);
  const double scale = detail::quantile(averages.scale, kStated);
  NavigationFinding finding{Kind::implausible, sensor.name, sensor.measurements.size(), sensor.measurements.front().t,
                            sensor.measurements.back().t};
  sensor.measurements.clear();
  for (std::size_t i = 0; i < averages.measurements.size(); ++i)
    if (averages.scale[i] <= kMaxScale * scale) sensor.measurements.push_back(averages.measurements[i]);
  sensor.sigma *= scale;
  finding.channel = fmt::format("in favour of {} averages, one per keyframe (keyframe_interval: {:g} s)",
                                sensor.measurements.size(), interval);
  std::vector<NavigationFinding> findings = {std::move(finding)};
  if (averages.rejected.count == 0) return findings;
  averages.rejected.channel = " of their keyframes";
  findings.push_back(std::move(averages.rejected));
  return findings;
}

}  // namespace

std::vector<NavigationFinding> average_readings(NavigationData& data) {
  std::vector<NavigationFinding> findings;
  std::vector<bool> fast;
  for (const EgoSensor& sensor : data.sensors) fast.push_back(!data.imu && is_fast(sensor, data.keyframe_interval));
  if (std::find(fast.begin(), fast.end(), true) == fast.end()) return findings;
  const std::vector<double> keyframes = keyframe_times(data, fast);
  for (std::size_t s = 0; s < data.sensors.size(); ++s)
    if (fast[s])
      for (NavigationFinding& finding : replace_readings(data.sensors[s], keyframes, data.keyframe_interval))
        findings.push_back(std::move(finding));
  return findings;
}

}  // namespace tandem
