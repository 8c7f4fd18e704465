#include <algorithm>
#include <cmath>
#include <cstdio>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/navigation_plausible.hpp>

namespace tandem {
namespace {

constexpr double kLeastForce = 7, kMostForce = 13;  // m/s²: the median of a vehicle's specific force, around gravity
constexpr double kFirst = 2.0;                      // s: over which the direction of gravity is told at the start
constexpr double kDown = -0.7071;                   // cosine: within 45° of straight down
constexpr double kKnownTilt = 0.5;                  // rad: a heading sensor's σ of roll and pitch, when it knows them
constexpr double kFastTurning = 8.0;                // rad/s: 460 °/s, which a vehicle does now and then at most
constexpr double kOften = 0.1;                      // share of the samples
constexpr double kWindow = 5.0, kTurned = 0.2;      // s and rad: what tells turning from a heading's noise
constexpr std::size_t kWindows = 5;                 // that are needed
constexpr double kDegrees = 57.29577951308232;      // in a radian
constexpr double kTipping = 0.5, kAveraged = 0.2;   // s: between two directions of the specific force, averaged
constexpr int kTippingWindows = 40;                 // that are needed, …
constexpr double kCorrelated = 0.7;                 // … and how well they agree; a rotorcraft's do not
constexpr double kSameSize = 1.5;
constexpr double kAboveWater = 2.0;  // m

double quantile(std::vector<double> values, double q) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(q * double(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

const EgoSensor* heading_sensor(const NavigationData& data) {
  for (const EgoSensor& sensor : data.sensors)
    if (sensor.type == EgoSensorType::heading && !sensor.measurements.empty()) return &sensor;
  return nullptr;
}

/// The sample at or after an instant; null where there is none within 1 s.
const ImuSample* sample_at(const ImuSensor& imu, double t) {
  const auto it = std::lower_bound(imu.samples.begin(), imu.samples.end(), t,
                                   [](const ImuSample& sample, double time) { return sample.t < time; });
  return it == imu.samples.end() || it->t > t + 1 ? nullptr : &*it;
}

std::string force_hint(double median) {
  if (median < 0.2 || (median > 1.5 && median < kLeastForce)) return "gravity must be in it, in m/s^2";
  if (median < 1.5) return "in g? multiply by 9.80665";
  if (median > 9000 && median < 10500) return "in mm/s^2? divide by 1000";
  if (median > 700 && median < 1300) return "in mg? multiply by 0.00980665";
  return "it must be in m/s^2";
}

/// The mean cosine between a heading sensor's up and the specific force.
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

/// Turning about the world's vertical by the gyroscope over turning by the heading sensor, window by window, where
/// that turns enough.
std::vector<double> turning_ratios(const ImuSensor& imu, const EgoSensor& heading) {
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
    if (to - heading.valid_at(m[begin]) < kWindow) continue;
    if (std::abs(by_heading) > kTurned) ratios.push_back(by_gyroscope / by_heading);
    by_heading = by_gyroscope = 0;
    begin = k;
  }
  return ratios;
}

bool looks_like_degrees(double ratio) { return std::abs(ratio) > kDegrees / 2 && std::abs(ratio) < 2 * kDegrees; }

/// How far the direction of the specific force turns in the sensor, against how far it does by the gyroscope: a vehicle
/// that tips and does not accelerate much has gravity for a witness of its angular rate's units and signs.
struct Tipping {
  double slope = 0, correlation = 0;  ///< 1 and 1 where they agree
  int windows = 0;
};

Tipping tipping(const ImuSensor& imu) {
  const auto& samples = imu.samples;
  Vector<3> bias = Vector<3>::Zero();
  for (const ImuSample& sample : samples) bias += sample.angular_rate / double(samples.size());

  Tipping tipping;
  double by_gyroscope = 0, by_force = 0, both = 0;
  std::size_t first = 0;
  for (double t = samples.front().t; t + kTipping + kAveraged < samples.back().t; t += kTipping) {
    while (samples[first].t < t) ++first;
    Vector<3> before = Vector<3>::Zero(), after = before, turned = before;
    double longest = 0;
    for (std::size_t i = first; i + 1 < samples.size() && samples[i].t < t + kTipping + kAveraged; ++i) {
      const double in = samples[i].t - t;
      if (in < kAveraged) before += samples[i].specific_force;
      if (in >= kTipping) after += samples[i].specific_force;
      longest = std::max(longest, samples[i + 1].t - samples[i].t);
      if (in >= 0.5 * kAveraged && in < kTipping + 0.5 * kAveraged)
        turned += (samples[i].angular_rate - bias) * (samples[i + 1].t - samples[i].t);
    }
    if (longest > kAveraged || before.isZero(0) || after.isZero(0)) continue;  // a gap
    before.normalize();
    after.normalize();
    const Vector<3> expected = 0.5 * (before + after).cross(turned), seen = after - before;
    by_gyroscope += expected.squaredNorm();
    by_force += seen.squaredNorm();
    both += expected.dot(seen);
    ++tipping.windows;
  }
  if (by_gyroscope == 0 || by_force == 0) return {};
  tipping.slope = both / by_gyroscope;
  tipping.correlation = both / std::sqrt(by_gyroscope * by_force);
  return tipping;
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
  const double median = quantile(std::move(magnitudes), 0.5);
  if (!(median >= kLeastForce && median <= kMostForce))
    throw Error(imu.name + ": the specific force is " + short_number(median) +
                " where gravity makes it some 9.8 m/s^2: " + force_hint(median));

  if (const EgoSensor* heading = heading_sensor(data); heading && heading->sigma.head<2>().maxCoeff() < kKnownTilt)
    if (mean_cosine_to_up(imu, *heading) < kDown)
      throw Error(
          imu.name + ": the specific force points down where " + heading->name +
          " says which way is up: at rest it must point up; turn its sign, or check the frame and the orientation");

  Vector<3> mean = Vector<3>::Zero();
  const double end = imu.samples.front().t + kFirst;
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
                                  [](const ImuSample& sample) { return sample.angular_rate.norm() > kFastTurning; });
  if (double(fast) > kOften * double(imu.samples.size()))
    throw Error(imu.name + ": it turns faster than " + short_number(kFastTurning) + " rad/s in " +
                short_number(std::round(100.0 * double(fast) / double(imu.samples.size()))) +
                " % of the samples, which looks like degrees: angular rates must be in rad/s");

  const Tipping tips = tipping(imu);
  if (tips.windows >= kTippingWindows && std::abs(tips.correlation) > kCorrelated) {
    const double ratio = 1 / tips.slope;
    const std::string seen = imu.name + ": by its angular rate it tips " + short_number(std::round(100 * ratio) / 100) +
                             " times as far as by its specific force";
    if (looks_like_degrees(ratio)) throw Error(seen + ", which looks like degrees: angular rates must be in rad/s");
    // Not by much more or less: swinging fast below its axis, a sensor has more acceleration than gravity.
    if (ratio < -1 / kSameSize && ratio > -kSameSize) throw Error(seen + ": the signs of one of the two are wrong");
  }

  const EgoSensor* heading = heading_sensor(data);
  if (!heading) return;
  const std::vector<double> ratios = turning_ratios(imu, *heading);
  if (ratios.size() < kWindows) return;
  const double ratio = quantile(ratios, 0.5);
  const std::string seen =
      imu.name + ": it turns " + short_number(std::round(100 * ratio) / 100) + " times as far as " + heading->name;
  if (looks_like_degrees(ratio)) throw Error(seen + ", which looks like degrees: angular rates must be in rad/s");
  if (ratio < -0.5) throw Error(seen + ": the sign of its angular rate, the frame or an orientation is wrong");
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
  const double most = quantile(std::move(sizes), 0.9);
  if (most > traits.most)
    throw Error(sensor.name + ": it measures " + std::string(traits.measures) + short_number(most) +
                std::string(traits.doubt));
  if (height && quantile(std::move(heights), 0.5) > kAboveWater)
    return NavigationFinding{NavigationFinding::Kind::above_water, sensor.name, sensor.measurements.size(),
                             sensor.measurements.front().t, sensor.measurements.back().t};
  return {};
}

}  // namespace tandem
