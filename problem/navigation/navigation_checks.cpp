#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <tandem/lie/error.hpp>
#include <tandem/problem/median.hpp>
#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/problem/navigation/navigation_plausible.hpp>

namespace tandem {
namespace {

using Kind = NavigationFinding::Kind;

constexpr double kStuckFor = 1.0;          // s: an inertial axis
constexpr std::size_t kStuckSamples = 20;  // that there must be in it
constexpr std::size_t kStuckLines = 10;    // another sensor
constexpr double kMayStay = 5.0;           // s
// A run of equal values is unusual when so many times as long as the mean run, which quantisation makes.
constexpr double kBeyondImuRuns = 20.0, kBeyondOtherRuns = 8.0;
constexpr std::size_t kClippedRun = 5;       // samples at the largest magnitude, one after the other
constexpr double kLeastRangeOfForce = 19.0;  // m/s²: no accelerometer's range is below 2 g, …
constexpr double kLeastRangeOfRate = 2.1;    // rad/s: … no gyroscope's below 125 °/s
constexpr double kLongSilence = 5.0;         // s
constexpr double kSilentIntervals = 20.0;    // times a sensor's usual interval
constexpr std::size_t kGapsOneByOne = 5;     // more of them are told together

bool finite(const ImuSample& sample) {
  return std::isfinite(sample.t) && sample.specific_force.allFinite() && sample.angular_rate.allFinite();
}
bool finite(const EgoMeasurement& m) {
  return std::isfinite(m.t) && m.value.allFinite() && m.rotation.quaternion().coeffs().allFinite();
}

template <class T>
void drop_if(const std::string& sensor, std::vector<T>& lines, Kind kind, const std::vector<bool>& dropped,
             std::vector<NavigationFinding>& findings) {
  NavigationFinding finding{kind, sensor};
  std::size_t kept = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!dropped[i]) {
      if (kept != i) lines[kept] = lines[i];
      ++kept;
      continue;
    }
    if (finding.count++ == 0) finding.from = lines[i].t;
    finding.to = lines[i].t;
  }
  lines.resize(kept, lines.empty() ? T{} : lines.front());
  if (finding.count > 0) findings.push_back(finding);
}

/// Members of a longest strictly increasing subsequence: what stays when as few lines as possible go. A clock that jumps
/// ahead for one line so costs that line alone, not all that follow.
template <class T>
std::vector<bool> increasing(const std::vector<T>& lines) {
  std::vector<std::size_t> tails;  // by length: the last line of the subsequence that ends soonest
  std::vector<std::ptrdiff_t> before(lines.size(), -1);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto at = std::lower_bound(tails.begin(), tails.end(), lines[i].t,
                                     [&](std::size_t line, double t) { return lines[line].t < t; });
    if (at != tails.end() && lines[*at].t == lines[i].t) continue;  // of one time, the first
    if (at != tails.begin()) before[i] = static_cast<std::ptrdiff_t>(*(at - 1));
    if (at == tails.end())
      tails.push_back(i);
    else
      *at = i;
  }
  std::vector<bool> kept(lines.size(), false);
  for (auto i = tails.empty() ? -1 : static_cast<std::ptrdiff_t>(tails.back()); i >= 0; i = before[std::size_t(i)])
    kept[std::size_t(i)] = true;
  return kept;
}

template <class T>
void clean_times(const std::string& sensor, std::vector<T>& lines, std::vector<NavigationFinding>& findings) {
  std::vector<bool> bad(lines.size());
  std::transform(lines.begin(), lines.end(), bad.begin(), [](const T& line) { return !finite(line); });
  drop_if(sensor, lines, Kind::not_finite, bad, findings);

  // First lines that repeat the one before, so that they are told from a clock that runs backwards.
  bad.assign(lines.size(), false);
  for (std::size_t i = 1; i < lines.size(); ++i) bad[i] = lines[i].t == lines[i - 1].t;
  drop_if(sensor, lines, Kind::repeated, bad, findings);

  bad = increasing(lines);
  bad.flip();
  drop_if(sensor, lines, Kind::backwards, bad, findings);
}

/// Runs of equal values [begin, end), and how long they are on average.
struct Runs {
  std::vector<std::pair<std::size_t, std::size_t>> all;
  double mean = 0;

  Runs(std::size_t count, const std::function<bool(std::size_t, std::size_t)>& equal) {
    for (std::size_t begin = 0, i = 1; i <= count; ++i) {
      if (i < count && equal(i - 1, i)) continue;
      all.emplace_back(begin, i);
      begin = i;
    }
    if (!all.empty()) mean = double(count) / double(all.size());
  }
  /// Whether a run is far longer than those that quantisation makes. One that takes up a good part of the recording is
  /// itself in the mean.
  bool unusual(std::size_t length, double beyond) const { return double(length) > beyond * mean || all.size() < 20; }
};

struct Channel {
  const char* name;
  double (*value)(const ImuSample&);
  double range;  ///< the least that any sensor has
  double ImuSensor::*limit;
};

constexpr std::array<Channel, 6> kChannels = {{
    {"specific force x", [](const ImuSample& s) { return s.specific_force[0]; }, kLeastRangeOfForce,
     &ImuSensor::max_specific_force},
    {"specific force y", [](const ImuSample& s) { return s.specific_force[1]; }, kLeastRangeOfForce,
     &ImuSensor::max_specific_force},
    {"specific force z", [](const ImuSample& s) { return s.specific_force[2]; }, kLeastRangeOfForce,
     &ImuSensor::max_specific_force},
    {"angular rate x", [](const ImuSample& s) { return s.angular_rate[0]; }, kLeastRangeOfRate,
     &ImuSensor::max_angular_rate},
    {"angular rate y", [](const ImuSample& s) { return s.angular_rate[1]; }, kLeastRangeOfRate,
     &ImuSensor::max_angular_rate},
    {"angular rate z", [](const ImuSample& s) { return s.angular_rate[2]; }, kLeastRangeOfRate,
     &ImuSensor::max_angular_rate},
}};

/// Whether another channel changes within [begin, end): an axis is stuck only where the rest lives.
bool others_vary(const ImuSensor& imu, const Channel& stuck, std::size_t begin, std::size_t end) {
  return std::any_of(kChannels.begin(), kChannels.end(), [&](const Channel& channel) {
    if (channel.value == stuck.value) return false;
    std::size_t changes = 0;
    for (std::size_t i = begin + 1; i < end; ++i)
      changes += channel.value(imu.samples[i]) != channel.value(imu.samples[i - 1]);
    return 2 * changes > end - begin;
  });
}

void add_run(NavigationFinding& finding, const ImuSensor& imu, std::size_t begin, std::size_t end) {
  if (finding.count == 0) finding.from = imu.samples[begin].t;
  finding.to = imu.samples[end - 1].t;
  finding.count += end - begin;
}

void check_channel(const ImuSensor& imu, const Channel& channel, std::vector<NavigationFinding>& findings) {
  NavigationFinding stuck{Kind::stuck, imu.name, 0, 0, 0, channel.name};
  NavigationFinding saturated{Kind::saturated, imu.name, 0, 0, 0, channel.name};
  const auto value = [&](std::size_t i) { return channel.value(imu.samples[i]); };
  const double limit = imu.*channel.limit;
  double largest = 0;
  for (std::size_t i = 0; i < imu.samples.size(); ++i) largest = std::max(largest, std::abs(value(i)));
  if (limit > 0)
    for (std::size_t i = 0; i < imu.samples.size(); ++i)
      if (std::abs(value(i)) >= limit) add_run(saturated, imu, i, i + 1);

  const Runs runs(imu.samples.size(), [&](std::size_t i, std::size_t j) { return value(i) == value(j); });
  for (const auto& [begin, end] : runs.all) {
    const bool at_the_end = std::abs(value(begin)) == largest && largest > channel.range;
    if (!(limit > 0) && at_the_end && end - begin >= kClippedRun) {
      add_run(saturated, imu, begin, end);
    } else if (imu.samples[end - 1].t - imu.samples[begin].t > kStuckFor && end - begin >= kStuckSamples &&
               runs.unusual(end - begin, kBeyondImuRuns) && !(limit > 0 && std::abs(value(begin)) >= limit) &&
               others_vary(imu, channel, begin, end)) {
      add_run(stuck, imu, begin, end);
    }
  }
  for (const NavigationFinding& finding : {saturated, stuck})
    if (finding.count > 0) findings.push_back(finding);
}

void check_gaps(const ImuSensor& imu, std::vector<NavigationFinding>& findings) {
  std::vector<NavigationFinding> gaps;
  for (std::size_t i = 1; i < imu.samples.size(); ++i)
    if (imu.samples[i].t - imu.samples[i - 1].t > imu.max_gap)
      gaps.push_back({Kind::gap, imu.name, 1, imu.samples[i - 1].t, imu.samples[i].t});
  if (gaps.size() > kGapsOneByOne) gaps = {{Kind::gap, imu.name, gaps.size(), gaps.front().from, gaps.back().to}};
  findings.insert(findings.end(), gaps.begin(), gaps.end());
}

/// Of another sensor, lines that repeat a value: once it hangs, what it says is no measurement.
void drop_stuck(EgoSensor& sensor, std::vector<NavigationFinding>& findings) {
  const auto& m = sensor.measurements;
  const Runs runs(m.size(), [&](std::size_t i, std::size_t j) {
    return m[i].value == m[j].value && m[i].rotation.quaternion().coeffs() == m[j].rotation.quaternion().coeffs();
  });
  std::vector<bool> stuck(m.size(), false);
  for (const auto& [begin, end] : runs.all) {
    const bool says_something = sensor.type->reading == EgoReading::orientation || !m[begin].value.isZero(0);
    if (end - begin < kStuckLines || !runs.unusual(end - begin, kBeyondOtherRuns) || !says_something) continue;
    // A vehicle may keep its depth for a while, to the last digit that is written; not its velocity or heading.
    if (sensor.type->may_stay && (runs.all.size() == 1 || m[end - 1].t - m[begin].t < kMayStay)) continue;
    std::fill(stuck.begin() + std::ptrdiff_t(begin) + 1, stuck.begin() + std::ptrdiff_t(end), true);
  }
  drop_if(sensor.name, sensor.measurements, Kind::stuck, stuck, findings);
}

/// Where a sensor gives nothing while the recording goes on, from first to last.
void check_coverage(const std::string& name, const std::vector<double>& times, double first, double last,
                    bool in_between, std::vector<NavigationFinding>& findings) {
  if (times.empty()) {
    findings.push_back({Kind::empty, name, 0, first, last});
    return;
  }
  double silence = kLongSilence;
  if (times.size() > 1) silence = std::max(silence, kSilentIntervals * detail::median_step(times));
  if (times.front() - first > silence) findings.push_back({Kind::late, name, 1, first, times.front()});
  NavigationFinding silent{Kind::silent, name};
  for (std::size_t i = 1; in_between && i < times.size(); ++i) {
    if (times[i] - times[i - 1] <= silence) continue;
    if (silent.count++ == 0) silent.from = times[i - 1];
    silent.to = times[i];
  }
  if (silent.count > 0) findings.push_back(silent);
  if (last - times.back() > silence) findings.push_back({Kind::early, name, 1, times.back(), last});
}

template <class T>
std::vector<double> times_of(const std::vector<T>& lines) {
  std::vector<double> times;
  for (const T& line : lines) times.push_back(line.t);
  return times;
}

void check_coverage(const NavigationData& data, std::vector<NavigationFinding>& findings) {
  double first = INFINITY, last = -INFINITY;
  const auto widen = [&](const auto& lines) {
    if (lines.empty()) return;
    first = std::min(first, lines.front().t);
    last = std::max(last, lines.back().t);
  };
  if (data.imu) widen(data.imu->samples);
  for (const EgoSensor& sensor : data.sensors) widen(sensor.measurements);
  if (data.imu) check_coverage(data.imu->name, times_of(data.imu->samples), first, last, false, findings);
  for (const EgoSensor& sensor : data.sensors)
    check_coverage(sensor.name, times_of(sensor.measurements), first, last, true, findings);
}

/// The density of white noise with the samples' median second difference, the median of three axes.
template <class Reading>
double scatter(const std::vector<ImuSample>& samples, double rate, Reading reading) {
  std::array<double, 3> density{};
  std::vector<double> differences(samples.size() - 2);
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < differences.size(); ++i)
      differences[i] =
          std::abs(reading(samples[i])[axis] - 2 * reading(samples[i + 1])[axis] + reading(samples[i + 2])[axis]);
    density[std::size_t(axis)] = detail::median(differences) / 0.6745 / std::sqrt(6.0 * rate);
  }
  std::sort(density.begin(), density.end());
  return density[1];
}

void check_vibration(const ImuSensor& imu, std::vector<NavigationFinding>& findings) {
  constexpr double far_more = 8.0;
  constexpr std::size_t enough = 1000;
  const bool stated = imu.noise.accelerometer > 0 && imu.noise.gyroscope > 0;
  if (imu.samples.size() < enough || !stated) return;
  const double from = imu.samples.front().t, to = imu.samples.back().t;
  const double rate = double(imu.samples.size() - 1) / (to - from);
  const double force = scatter(imu.samples, rate, [](const ImuSample& s) { return s.specific_force; });
  const double turn = scatter(imu.samples, rate, [](const ImuSample& s) { return s.angular_rate; });
  if (force < far_more * imu.noise.accelerometer && turn < far_more * imu.noise.gyroscope) return;
  NavigationFinding finding{NavigationFinding::Kind::vibration, imu.name, imu.samples.size(), from, to};
  finding.accelerometer = std::max(force, imu.noise.accelerometer);
  finding.gyroscope = std::max(turn, imu.noise.gyroscope);
  findings.push_back(finding);
}

}  // namespace

std::string NavigationFinding::text() const {
  const std::string n = std::to_string(count), lines = count == 1 ? " line" : " lines";
  const std::string at = from == to ? " at " + short_number(from) + " s"
                                    : " between " + short_number(from) + " and " + short_number(to) + " s";
  const std::string were = count == 1 ? " is" : " are";
  switch (kind) {
    case Kind::not_finite:
      return sensor + ": " + n + lines + at + " with numbers that are not finite" + were + " dropped";
    case Kind::backwards:
      return sensor + ": " + n + lines + at + " whose time runs backwards" + were + " dropped";
    case Kind::repeated:
      return sensor + ": " + n + lines + at + (count == 1 ? " that repeats" : " that repeat") + " a time" + were +
             " dropped";
    case Kind::saturated:
      return sensor + ": " + n + (count == 1 ? " sample" : " samples") + at + (count == 1 ? " is" : " are") +
             " at the end of the range of " + channel + " and say too little; they are kept";
    case Kind::stuck:
      if (channel.empty()) return sensor + ": it repeats one value;" + " " + n + lines + at + were + " dropped";
      return sensor + ": " + channel + " is stuck at one value for " + n + " samples" + at;
    case Kind::gap:
      if (count == 1) return sensor + ": no sample" + at + ", longer than max_gap: the estimate is split there";
      return sensor + ": " + n + " gaps longer than max_gap" + at + ": the estimate is split there";
    case Kind::silent:
      return sensor + ": silent" + at + (count == 1 ? "" : ", " + n + " times");
    case Kind::late:
      return sensor + ": begins at " + short_number(to) + " s, when the recording has begun at " + short_number(from) +
             " s";
    case Kind::early:
      return sensor + ": ends at " + short_number(from) + " s, before the recording does at " + short_number(to) + " s";
    case Kind::empty:
      return sensor + ": gives nothing";
    case Kind::upside_down:
      return sensor + ": reads like an upside-down body" + at +
             ", since its specific force points down: check its sign, the frame and the orientation if that is not so";
    case Kind::vibration:
      return sensor + ": neighbouring samples scatter as noise of " + short_number(accelerometer) + " m/s²/√Hz and " +
             short_number(gyroscope) +
             " rad/s/√Hz would, far more than is stated: where that is vibration, these are " +
             "the densities to navigate with (--vibration)";
    case Kind::above_water:
      break;
  }
  return sensor + ": most of it is above the world's origin; z points up (in NED files down)";
}

std::vector<NavigationFinding> check(NavigationData& data) {
  std::vector<NavigationFinding> findings;
  if (data.imu) {
    clean_times(data.imu->name, data.imu->samples, findings);
    if (data.imu->samples.size() < 2) throw Error(data.imu->name + ": two samples or more are needed");
    if (const auto finding = check_specific_force(data)) findings.push_back(*finding);
    for (const Channel& channel : kChannels) check_channel(*data.imu, channel, findings);
    check_gaps(*data.imu, findings);
    check_vibration(*data.imu, findings);
  }
  for (EgoSensor& sensor : data.sensors) clean_times(sensor.name, sensor.measurements, findings);
  check_coverage(data, findings);
  for (EgoSensor& sensor : data.sensors) {
    drop_stuck(sensor, findings);
    if (const auto finding = check_magnitude(sensor)) findings.push_back(*finding);
  }
  if (data.imu) check_angular_rate(data);
  return findings;
}

}  // namespace tandem
