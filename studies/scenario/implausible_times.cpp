#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/studies/scenario/implausible_times.hpp>

namespace tandem {
namespace {

constexpr double kMaxStep = 1000;          // s, median step of the stream with the most rows
constexpr double kMaxGap = 3600;           // s without a row of any stream
constexpr double kMaxKeyframes = 200'000;  // in the whole problem
constexpr double kMaxSpanRatio = 10;       // time span of a sensor relative to that of the motion

struct RowTime {
  double t;  // time of validity [s]
  std::size_t stream;
};

/// Returns a time for a message, with a bounded number of digits.
std::string time_text(double t, int decimals = 3) {
  return std::abs(t) < 1e12 ? fmt::format("{:.{}f}", t, decimals) : fmt::format("{:.6g}", t);
}

/// The times of all rows of a recording, by stream.
class RecordedTimes {
 public:
  explicit RecordedTimes(const Scenario& scenario) {
    const TrackingData& data = scenario.data;
    const NavigationData* own = data.odometry.empty() && scenario.navigation ? &*scenario.navigation : nullptr;
    if (!data.odometry.empty()) add("the odometry", data.odometry, 0);
    if (own && own->imu) add("the imu", own->imu->samples, 0);
    has_motion_ = !names_.empty();
    for (const TargetSensor& sensor : data.sensors) {
      add(sensor.name, sensor.measurements, sensor.delay);
      measurements_ += sensor.measurements.size();
    }
    if (own)
      for (const EgoSensor& sensor : own->sensors) add(sensor.name, sensor.measurements, sensor.delay);
  }

  /// Checks for times that are not in seconds: in the stream with the most rows, or in a sensor that spans much more
  /// time than the motion (odometry or imu).
  std::string check_unit() const {
    const std::size_t n = names_.size();
    std::vector<std::vector<double>> times(n);
    for (const RowTime& row : rows_) times[row.stream].push_back(row.t);
    if (n == 0) return "";
    std::vector<double> step;
    std::size_t densest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      std::sort(times[i].begin(), times[i].end());
      step.push_back(detail::median_step(times[i]));
      if (times[i].size() > times[densest].size()) densest = i;
    }
    if (step[densest] >= kMaxStep)
      return fmt::format(
          "rows of {} are {:.3g} s apart; times must be in seconds, but these seem to be in micro- or nanoseconds",
          names_[densest], step[densest]);
    if (!has_motion_ || times[0].size() < 2) return "";
    // The median step can be zero if times are rounded, so the span of the central 90 % of the rows counts too.
    const std::vector<double>& motion = times[0];
    const double most = detail::quantile(motion, 0.95) - detail::quantile(motion, 0.05);
    const double moved = std::max(step[0] * double(motion.size()), most);
    for (std::size_t i = 1; i < n; ++i)
      if (step[i] * double(times[i].size()) > kMaxSpanRatio * moved + kMaxStep)
        return fmt::format(
            "{} rows of {} are {:.3g} s apart, but {} covers only {:.3g} s; times must be in seconds, but these seem "
            "to be "
            "in milli-, micro- or nanoseconds",
            times[i].size(), names_[i], step[i], names_[0], moved);
    return "";
  }

  /// Checks for long gaps and for too many keyframes at the given interval [s].
  std::string check_length(double interval) {
    std::sort(rows_.begin(), rows_.end(), [](const RowTime& a, const RowTime& b) { return a.t < b.t; });
    double keyframes = double(measurements_);
    for (std::size_t i = 1; i < rows_.size(); ++i) {
      const RowTime &from = rows_[i - 1], &to = rows_[i];
      keyframes += (to.t - from.t) / interval;
      if (to.t - from.t > kMaxGap)
        return fmt::format("no data for {} s, between {} s ({}) and {} s ({}); one of them may be on another clock",
                           time_text(to.t - from.t, 0), time_text(from.t), names_[from.stream], time_text(to.t),
                           names_[to.stream]);
    }
    if (keyframes <= kMaxKeyframes) return "";
    return fmt::format("{:.0f} s of data with {} measurements of the target need {:.0f} keyframes; the limit is {:.0f}",
                       rows_.back().t - rows_.front().t, measurements_, keyframes, kMaxKeyframes);
  }

 private:
  template <class Stream>
  void add(const std::string& name, const Stream& stream, double delay) {
    for (const auto& entry : stream) rows_.push_back({entry.t - delay, names_.size()});
    names_.push_back(name);
  }

  std::vector<std::string> names_;
  std::vector<RowTime> rows_;
  bool has_motion_ = false;       // the first stream is the odometry or the imu
  std::size_t measurements_ = 0;  // measurements of the target
};

}  // namespace

std::string implausible_times(const Scenario& scenario) {
  RecordedTimes recorded(scenario);
  const double interval = scenario.data.odometry.empty() && scenario.navigation ? scenario.navigation->keyframe_interval
                                                                                : scenario.data.keyframe_interval;
  std::string why = recorded.check_unit();
  return why.empty() ? recorded.check_length(interval) : why;
}

}  // namespace tandem
