#include <algorithm>
#include <cmath>
#include <cstdio>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/navigation_plausibility.hpp>
#include <tandem/problem/quantile.hpp>

namespace tandem {
namespace {

constexpr double kMinForce = 7, kMaxForce = 13;  // m/s²; plausible median specific force of a vehicle.
constexpr double kStartInterval = 2.0;           // s; averaging time of the specific force at the start.
constexpr double kDown = -0.7071;                // Cosine of the angle to the vertical: within 45° of straight down.
constexpr double kKnownTilt = 0.5;               // rad; a heading sensor with smaller σ measures roll and pitch.
// Vehicles exceed 8 rad/s (460 °/s) in at most this fraction of the samples.
constexpr double kFastTurn = 8.0;  // rad/s
constexpr double kMaxFastFraction = 0.1;
// Yaw is compared over windows in which it changes by more than the noise of a heading sensor.
constexpr double kYawWindow = 5.0;              // s
constexpr double kMinYawChange = 0.2;           // rad
constexpr std::size_t kYawWindows = 5;          // Minimum number of windows.
constexpr double kDegrees = 57.29577951308232;  // Degrees in a radian.
// Tilt is compared over pairs of mean specific forces, if their changes correlate with the angular rate. On a
// rotorcraft they do not.
constexpr double kTiltStep = 0.5, kTiltAverage = 0.2;  // s; distance of the pair, averaging time.
constexpr int kTiltPairs = 40;                         // Minimum number of pairs.
constexpr double kMinCorrelation = 0.7;
constexpr double kSimilarRatio = 1.5;  // a wrong sign gives a ratio between −1.5 and −1/1.5
constexpr double kAboveWater = 2.0;    // m

const EgoSensor* heading_sensor(const NavigationData& data) {
  for (const EgoSensor& sensor : data.sensors)
    if (sensor.type == EgoSensorType::heading && !sensor.measurements.empty()) return &sensor;
  return nullptr;
}

/// Returns the first sample at or after t; null if there is none within 1 s.
const ImuSample* sample_at(const ImuSensor& imu, double t) {
  const auto it = std::lower_bound(imu.samples.begin(), imu.samples.end(), t,
                                   [](const ImuSample& sample, double time) { return sample.t < time; });
  return it == imu.samples.end() || it->t > t + 1 ? nullptr : &*it;
}

constexpr std::string_view kDegreesHint = "; if angular rates are in degrees per second, convert them to rad/s";

std::string force_hint(double median) {
  if (median < 0.2 || (median > 1.5 && median < kMinForce)) return "samples must include gravity, in m/s^2";
  if (median < 1.5) return "if samples are in g, multiply them by 9.80665";
  if (median > 9000 && median < 10500) return "if samples are in mm/s^2, divide them by 1000";
  if (median > 700 && median < 1300) return "if samples are in mg, multiply them by 0.00980665";
  return "give samples in m/s^2";
}

/// Returns the mean cosine of the angle between the specific force and the vertical, according to the heading sensor.
double mean_cosine_to_up(const ImuSensor& imu, const EgoSensor& heading) {
  double sum = 0;
  std::size_t count = 0;
  for (const EgoMeasurement& m : heading.measurements) {
    const ImuSample* sample = sample_at(imu, heading.valid_at(m));
    if (!sample || sample->specific_force.norm() == 0) continue;
    const SO3 body = m.rotation * heading.mount.rotation().inverse();
    sum += (body * imu.mount.rotation()).act(sample->specific_force.normalized()).z();
    ++count;
  }
  return count == 0 ? 1.0 : sum / double(count);
}

/// Returns the ratio of the yaw changes from gyroscope and heading sensor for each window with a sufficient change.
std::vector<double> yaw_ratios(const ImuSensor& imu, const EgoSensor& heading) {
  std::vector<double> ratios;
  std::size_t i = 0, begin = 0;
  double by_heading = 0, by_gyroscope = 0;
  const auto& m = heading.measurements;
  for (std::size_t k = 1; k < m.size(); ++k) {
    const SO3 before = m[k - 1].rotation * heading.mount.rotation().inverse();
    const double from = heading.valid_at(m[k - 1]), to = heading.valid_at(m[k]);
    const Matrix<1, 3> up = (before * imu.mount.rotation()).matrix().row(2);
    by_heading += (m[k].rotation * m[k - 1].rotation.inverse()).Log().z();
    while (i < imu.samples.size() && imu.samples[i].t < from) ++i;
    for (; i + 1 < imu.samples.size() && imu.samples[i].t < to; ++i)
      by_gyroscope += up.dot(imu.samples[i].angular_rate) * (std::min(imu.samples[i + 1].t, to) - imu.samples[i].t);
    if (to - heading.valid_at(m[begin]) < kYawWindow) continue;
    if (std::abs(by_heading) > kMinYawChange) ratios.push_back(by_gyroscope / by_heading);
    by_heading = by_gyroscope = 0;
    begin = k;
  }
  return ratios;
}

bool looks_like_degrees(double ratio) { return std::abs(ratio) > kDegrees / 2 && std::abs(ratio) < 2 * kDegrees; }

/// Regression of tilt changes, seen in the direction of the specific force, on those predicted from the gyroscope. If
/// the vehicle tilts without much acceleration, gravity verifies the unit and the sign of the angular rate.
struct TiltComparison {
  double slope = 0, correlation = 0;  ///< both 1 if they agree
  int pairs = 0;
};

TiltComparison compare_tilt(const ImuSensor& imu) {
  const auto& samples = imu.samples;
  Vector<3> bias = Vector<3>::Zero();
  for (const ImuSample& sample : samples) bias += sample.angular_rate / double(samples.size());

  TiltComparison result;
  double by_gyroscope = 0, by_force = 0, both = 0;
  std::size_t first = 0;
  for (double t = samples.front().t; t + kTiltStep + kTiltAverage < samples.back().t; t += kTiltStep) {
    while (samples[first].t < t) ++first;
    Vector<3> before = Vector<3>::Zero(), after = before, turned = before;
    double longest = 0;
    for (std::size_t i = first; i + 1 < samples.size() && samples[i].t < t + kTiltStep + kTiltAverage; ++i) {
      const double in = samples[i].t - t;
      if (in < kTiltAverage) before += samples[i].specific_force;
      if (in >= kTiltStep) after += samples[i].specific_force;
      longest = std::max(longest, samples[i + 1].t - samples[i].t);
      if (in >= 0.5 * kTiltAverage && in < kTiltStep + 0.5 * kTiltAverage)
        turned += (samples[i].angular_rate - bias) * (samples[i + 1].t - samples[i].t);
    }
    if (longest > kTiltAverage || before.isZero(0) || after.isZero(0)) continue;  // a gap
    before.normalize();
    after.normalize();
    const Vector<3> expected = 0.5 * (before + after).cross(turned), seen = after - before;
    by_gyroscope += expected.squaredNorm();
    by_force += seen.squaredNorm();
    both += expected.dot(seen);
    ++result.pairs;
  }
  if (by_gyroscope == 0 || by_force == 0) return {};
  result.slope = both / by_gyroscope;
  result.correlation = both / std::sqrt(by_gyroscope * by_force);
  return result;
}

}  // namespace

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::optional<NavigationFinding> check_specific_force(const NavigationData& data) {
  const ImuSensor& imu = *data.imu;
  std::vector<double> magnitudes;
  for (const ImuSample& sample : imu.samples) magnitudes.push_back(sample.specific_force.norm());
  const double median = detail::median(std::move(magnitudes));
  if (!(median >= kMinForce && median <= kMaxForce))
    throw BadInputError(imu.name + ": the median specific force is " + short_number(median) +
                        " m/s^2, but gravity alone is 9.8; " + force_hint(median));

  if (const EgoSensor* heading = heading_sensor(data); heading && heading->sigma.head<2>().maxCoeff() < kKnownTilt)
    if (mean_cosine_to_up(imu, *heading) < kDown)
      throw BadInputError(imu.name + ": the specific force points down according to " + heading->name +
                          ", but must point up at rest; change its sign, or check the frame and the orientation");

  Vector<3> mean = Vector<3>::Zero();
  const double end = imu.samples.front().t + kStartInterval;
  NavigationFinding finding{NavigationFinding::Kind::upside_down, imu.name, 0, imu.samples.front().t};
  for (const ImuSample& sample : imu.samples) {
    if (sample.t > end) break;
    mean += imu.mount.rotation().act(sample.specific_force);
    finding.to = sample.t;
    ++finding.count;
  }
  if (mean.normalized().z() < kDown) return finding;
  return {};
}

void check_angular_rate(const NavigationData& data) {
  const ImuSensor& imu = *data.imu;
  const auto fast = std::count_if(imu.samples.begin(), imu.samples.end(),
                                  [](const ImuSample& sample) { return sample.angular_rate.norm() > kFastTurn; });
  if (double(fast) > kMaxFastFraction * double(imu.samples.size()))
    throw BadInputError(imu.name + ": " + short_number(std::round(100.0 * double(fast) / double(imu.samples.size()))) +
                        " % of the angular rates exceed " + short_number(kFastTurn) + " rad/s" +
                        std::string(kDegreesHint));

  const TiltComparison tilt = compare_tilt(imu);
  if (tilt.pairs >= kTiltPairs && std::abs(tilt.correlation) > kMinCorrelation) {
    const double ratio = 1 / tilt.slope;
    const std::string seen = imu.name + ": tilt changes from the angular rate are " +
                             short_number(std::round(100 * ratio) / 100) + " times those from the specific force";
    if (looks_like_degrees(ratio)) throw BadInputError(seen + std::string(kDegreesHint));
    // A sensor that swings below its axis can have accelerations above gravity, so other ratios are not an error.
    if (ratio < -1 / kSimilarRatio && ratio > -kSimilarRatio)
      throw BadInputError(seen + "; change the sign of one of the two");
  }

  const EgoSensor* heading = heading_sensor(data);
  if (!heading) return;
  const std::vector<double> ratios = yaw_ratios(imu, *heading);
  if (ratios.size() < kYawWindows) return;
  const double ratio = detail::median(ratios);
  const std::string seen = imu.name + ": yaw changes from the angular rate are " +
                           short_number(std::round(100 * ratio) / 100) + " times those from " + heading->name;
  if (looks_like_degrees(ratio)) throw BadInputError(seen + std::string(kDegreesHint));
  if (ratio < -0.5) throw BadInputError(seen + "; check the sign of the angular rate, the frame and the orientations");
}

std::optional<NavigationFinding> check_magnitude(const EgoSensor& sensor) {
  const EgoSensorTraits& traits = sensor.type.traits();
  if (sensor.measurements.empty() || traits.reading == EgoReading::orientation) return {};
  const bool height = traits.reading == EgoReading::world_height;
  std::vector<double> sizes, heights;
  for (const EgoMeasurement& m : sensor.measurements) {
    sizes.push_back(height ? std::abs(m.value.z()) : m.value.norm());
    heights.push_back(m.value.z());
  }
  const double size = detail::quantile(std::move(sizes), 0.9);
  if (size > traits.max_magnitude)
    throw BadInputError(sensor.name + ": the " + std::string(traits.quantity) + " is " + short_number(size) +
                        (traits.unit.empty() ? "" : " ") + std::string(traits.unit) + ", " + std::string(traits.hint));
  if (height && detail::median(std::move(heights)) > kAboveWater)
    return NavigationFinding{NavigationFinding::Kind::above_water, sensor.name, sensor.measurements.size(),
                             sensor.measurements.front().t, sensor.measurements.back().t};
  return {};
}

}  // namespace tandem
