#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/imu_screen.hpp>
#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/problem/navigation/navigation_plausibility.hpp>
#include <tandem/problem/navigation/reading_screen.hpp>
#include <tandem/problem/quantile.hpp>

namespace tandem {
namespace {

using Kind = NavigationFinding::Kind;

// A stuck IMU axis repeats one value for more than this time and at least this many samples.
constexpr double kStuckDuration = 1.0;  // s
constexpr std::size_t kStuckSamples = 20;
// A run of equal values is unusual if it exceeds this multiple of the mean run length, which quantisation determines.
constexpr double kImuRunRatio = 20.0;
constexpr std::size_t kClippedRun = 5;  // consecutive samples at the largest magnitude that indicate saturation
// Smallest ranges of sensors on the market: 2 g and 125 °/s.
constexpr double kMinForceRange = 19.0;  // m/s²
constexpr double kMinRateRange = 2.1;    // rad/s
// A sensor is silent if it has no measurement for longer than this time and this multiple of its median interval.
constexpr double kMinSilence = 5.0;  // s
constexpr double kSilentIntervals = 20.0;
constexpr std::size_t kMaxListedGaps = 5;  // more gaps than this are merged into one finding

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

/// Marks the members of a longest strictly increasing subsequence of the times. Dropping the other lines drops the
/// fewest lines: if the clock jumps ahead for one line, only this line is dropped.
template <class T>
std::vector<bool> increasing(const std::vector<T>& lines) {
  std::vector<std::size_t> tails;  // per length: last line of the subsequence with the earliest end
  std::vector<std::ptrdiff_t> before(lines.size(), -1);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto at = std::lower_bound(tails.begin(), tails.end(), lines[i].t,
                                     [&](std::size_t line, double t) { return lines[line].t < t; });
    if (at != tails.end() && lines[*at].t == lines[i].t) continue;  // keep the first of equal times
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

  // Drop repeated times first, to distinguish them from a clock that runs backwards.
  bad.assign(lines.size(), false);
  for (std::size_t i = 1; i < lines.size(); ++i) bad[i] = lines[i].t == lines[i - 1].t;
  drop_if(sensor, lines, Kind::repeated, bad, findings);

  bad = increasing(lines);
  bad.flip();
  drop_if(sensor, lines, Kind::backwards, bad, findings);
}

/// Runs of equal values [begin, end) and their mean length.
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
  /// Returns whether a run is much longer than quantisation explains. With few runs, each long one is unusual, because
  /// it dominates the mean.
  bool unusual(std::size_t length, double ratio) const { return double(length) > ratio * mean || all.size() < 20; }
};

struct Channel {
  const char* name;
  double (*value)(const ImuSample&);
  double range;  ///< lower limit of the range of any sensor
  double ImuSensor::*limit;
};

constexpr std::array<Channel, 6> kChannels = {{
    {"specific force x", [](const ImuSample& s) { return s.specific_force[0]; }, kMinForceRange,
     &ImuSensor::max_specific_force},
    {"specific force y", [](const ImuSample& s) { return s.specific_force[1]; }, kMinForceRange,
     &ImuSensor::max_specific_force},
    {"specific force z", [](const ImuSample& s) { return s.specific_force[2]; }, kMinForceRange,
     &ImuSensor::max_specific_force},
    {"angular rate x", [](const ImuSample& s) { return s.angular_rate[0]; }, kMinRateRange,
     &ImuSensor::max_angular_rate},
    {"angular rate y", [](const ImuSample& s) { return s.angular_rate[1]; }, kMinRateRange,
     &ImuSensor::max_angular_rate},
    {"angular rate z", [](const ImuSample& s) { return s.angular_rate[2]; }, kMinRateRange,
     &ImuSensor::max_angular_rate},
}};

/// Returns whether another channel changes within [begin, end). If none does, the vehicle is at rest.
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
    const bool clipped = std::abs(value(begin)) == largest && largest > channel.range;
    if (!(limit > 0) && clipped && end - begin >= kClippedRun) {
      add_run(saturated, imu, begin, end);
    } else if (imu.samples[end - 1].t - imu.samples[begin].t > kStuckDuration && end - begin >= kStuckSamples &&
               runs.unusual(end - begin, kImuRunRatio) && !(limit > 0 && std::abs(value(begin)) >= limit) &&
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
  if (gaps.size() > kMaxListedGaps) gaps = {{Kind::gap, imu.name, gaps.size(), gaps.front().from, gaps.back().to}};
  findings.insert(findings.end(), gaps.begin(), gaps.end());
}

/// Discards the lines of a sensor with implausible values.
void drop_implausible(EgoSensor& sensor, std::vector<NavigationFinding>& findings) {
  const ScreenedByFault found = screen(sensor.measurements, screen_options(sensor),
                                       [&](const EgoMeasurement& m) { return reading(sensor.type, m); });
  for (int i = 0; i < kReadingFaults; ++i)
    if (const ScreenedLines& lines = found[std::size_t(i)]; lines.count > 0)
      findings.push_back(
          {Kind::implausible, sensor.name, lines.count, lines.from, lines.to, std::string(text(ReadingFault(i)))});
}

/// Drops the samples of an IMU that are not physical.
void drop_implausible(ImuSensor& imu, std::vector<NavigationFinding>& findings) {
  std::array<ScreenedLines, kImuFaults> found{};
  const std::vector<std::optional<ImuFault>> known = faults_beside_neighbours(imu.samples);
  ImuScreen screen(imu);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < known.size(); ++k) {
    ImuSample sample = imu.samples[k];
    const auto fault = screen.judge(sample, known[k]);
    if (!fault) {
      imu.samples[kept++] = sample;
      continue;
    }
    ScreenedLines& of = found[std::size_t(*fault)];
    if (of.count++ == 0) of.from = sample.t;
    of.to = sample.t;
  }
  imu.samples.resize(kept, {0, Vector<3>::Zero(), Vector<3>::Zero()});
  for (int i = 0; i < kImuFaults; ++i)
    if (const ScreenedLines& of = found[std::size_t(i)]; of.count > 0)
      findings.push_back({Kind::implausible, imu.name, of.count, of.from, of.to, std::string(text(ImuFault(i)))});
}

/// Finds intervals without measurements of a sensor, in a recording from `first` to `last` [s]. `in_between` includes
/// those between its measurements.
void check_coverage(const std::string& name, const std::vector<double>& times, double first, double last,
                    bool in_between, std::vector<NavigationFinding>& findings) {
  if (times.empty()) {
    findings.push_back({Kind::empty, name, 0, first, last});
    return;
  }
  double silence = kMinSilence;
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

/// Estimates a noise density from the median second difference of the samples. Returns the median of the axes.
template <class Reading>
double noise_density(const std::vector<ImuSample>& samples, double rate, Reading reading) {
  std::vector<double> density;
  std::vector<double> differences(samples.size() - 2);
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < differences.size(); ++i)
      differences[i] =
          std::abs(reading(samples[i])[axis] - 2 * reading(samples[i + 1])[axis] + reading(samples[i + 2])[axis]);
    density.push_back(detail::median(differences) / 0.6745 / std::sqrt(6.0 * rate));
  }
  return detail::median(std::move(density));
}

void check_vibration(const ImuSensor& imu, std::vector<NavigationFinding>& findings) {
  constexpr double kRatio = 8.0;
  constexpr std::size_t kMinSamples = 1000;
  const bool noise_given = imu.noise.accelerometer > 0 && imu.noise.gyroscope > 0;
  if (imu.samples.size() < kMinSamples || !noise_given) return;
  const double from = imu.samples.front().t, to = imu.samples.back().t;
  const double rate = double(imu.samples.size() - 1) / (to - from);
  const double force = noise_density(imu.samples, rate, [](const ImuSample& s) { return s.specific_force; });
  const double turn = noise_density(imu.samples, rate, [](const ImuSample& s) { return s.angular_rate; });
  if (force < kRatio * imu.noise.accelerometer && turn < kRatio * imu.noise.gyroscope) return;
  NavigationFinding finding{NavigationFinding::Kind::vibration, imu.name, imu.samples.size(), from, to};
  finding.accelerometer = std::max(force, imu.noise.accelerometer);
  finding.gyroscope = std::max(turn, imu.noise.gyroscope);
  findings.push_back(finding);
}

/// Returns a time stamp [s]; with hundredths if it is too large for a short number, as are seconds since 1970.
std::string time_text(double t) {
  if (std::abs(t) < 1e5) return short_number(t);
  std::array<char, 32> text{};
  const int size = std::snprintf(text.data(), text.size(), "%.2f", t);
  return std::string(text.data(), std::size_t(std::min(size, int(text.size()) - 1)));
}

}  // namespace

std::string NavigationFinding::text() const {
  const std::string n = std::to_string(count), plural = count == 1 ? "" : "s";
  const std::string at =
      from == to ? " at " + time_text(from) + " s" : " between " + time_text(from) + " and " + time_text(to) + " s";
  const std::string dropped = sensor + ": dropped " + n + " line" + plural + at;
  switch (kind) {
    case Kind::not_finite:
      return dropped + " " + std::string(tandem::text(ReadingFault::missing));
    case Kind::implausible:
      return dropped + " " + channel;
    case Kind::jump:
      return sensor + ": jumps to a new origin" + at;
    case Kind::rejected:
      return sensor + ": rejected " + n + " measurement" + plural + at +
             (count == 1 ? ", which contradicts" : ", which contradict") + " the other measurements" + channel;
    case Kind::backwards:
      return dropped + " whose time runs backwards";
    case Kind::repeated:
      return dropped + " with a repeated time";
    case Kind::saturated:
      return sensor + ": " + n + " sample" + plural + " of " + channel + at + (count == 1 ? " is" : " are") +
             " saturated, but kept";
    case Kind::stuck:
      return sensor + ": " + channel + " is stuck at one value for " + n + " samples" + at;
    case Kind::gap:
      if (count == 1)
        return sensor + ": no samples" + at + ", which is longer than max_gap; the chain of keyframes is split there";
      return sensor + ": " + n + " gaps longer than max_gap" + at + "; the chain of keyframes is split there";
    case Kind::silent:
      return sensor + ": " + (count == 1 ? "no measurements" : n + " long gaps") + at;
    case Kind::late:
      return sensor + ": starts at " + time_text(to) + " s, but the recording starts at " + time_text(from) + " s";
    case Kind::early:
      return sensor + ": ends at " + time_text(from) + " s, but the recording ends at " + time_text(to) + " s";
    case Kind::empty:
      return sensor + ": no measurements";
    case Kind::upside_down:
      return sensor + ": the specific force points down" + at +
             "; unless the vehicle is upside down, check the sign, the frame and the orientation";
    case Kind::vibration:
      return sensor + ": the samples scatter like noise of " + short_number(accelerometer) + " m/s²/√Hz and " +
             short_number(gyroscope) + " rad/s/√Hz, far above the given noise; if vibration is the cause, use " +
             "these densities (--vibration)";
    case Kind::above_water:
      break;
  }
  return sensor + ": most heights are above the world's origin; z points up (in NED files down)";
}

std::vector<NavigationFinding> check(NavigationData& data) {
  std::vector<NavigationFinding> findings;
  if (data.imu) {
    clean_times(data.imu->name, data.imu->samples, findings);
    if (data.imu->samples.size() < 2) throw BadInputError(data.imu->name + ": at least two samples are required");
    if (const auto finding = check_specific_force(data)) findings.push_back(*finding);
  }
  for (EgoSensor& sensor : data.sensors) clean_times(sensor.name, sensor.measurements, findings);
  for (EgoSensor& sensor : data.sensors)
    if (const auto finding = check_magnitude(sensor)) findings.push_back(*finding);
  check_coverage(data, findings);
  for (EgoSensor& sensor : data.sensors) drop_implausible(sensor, findings);
  if (!data.imu) return findings;
  check_angular_rate(data);
  drop_implausible(*data.imu, findings);
  for (const Channel& channel : kChannels) check_channel(*data.imu, channel, findings);
  check_gaps(*data.imu, findings);
  check_vibration(*data.imu, findings);
  return findings;
}

}  // namespace tandem
