#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <tandem/problem/median.hpp>
#include <tandem/studies/scenario/implausible_times.hpp>

namespace tandem {
namespace {

constexpr double kStep = 1000;     // s between lines of the densest stream: no recording is so slow
constexpr double kGap = 3600;      // s without a line of any stream
constexpr double kMost = 200'000;  // keyframes
constexpr double kLonger = 10;     // times the span of what the chaser moves by: no sensor has that many lines

struct Line {
  double t;  // s, when it was valid
  std::size_t stream;
};

/// A time as a sentence has it, however large it is.
std::string text_of(double t, int decimals = 3) {
  return std::abs(t) < 1e12 ? fmt::format("{:.{}f}", t, decimals) : fmt::format("{:.6g}", t);
}

/// What was recorded, by stream.
class Recorded {
 public:
  explicit Recorded(const Scenario& scenario) {
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

  /// Stamps that are too far apart: of the densest stream, or of one beside what the chaser moves by.
  std::string not_seconds() const {
    const std::size_t n = names_.size();
    std::vector<std::vector<double>> times(n);
    for (const Line& line : lines_) times[line.stream].push_back(line.t);
    if (n == 0) return "";
    std::vector<double> step;
    std::size_t densest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      std::sort(times[i].begin(), times[i].end());
      step.push_back(detail::median_step(times[i]));
      if (times[i].size() > times[densest].size()) densest = i;
    }
    if (step[densest] >= kStep)
      return fmt::format("lines of {} are {:.3g} s apart: times are in seconds, are these in nano- or microseconds?",
                         names_[densest], step[densest]);
    if (!has_motion_ || times[0].size() < 2) return "";
    const std::vector<double>& motion = times[0];  // whose stamps may be rounded, so that most steps are none
    const double most = motion[motion.size() * 19 / 20] - motion[motion.size() / 20];
    const double moved = std::max(step[0] * double(motion.size()), most);
    for (std::size_t i = 1; i < n; ++i)
      if (step[i] * double(times[i].size()) > kLonger * moved + kStep)
        return fmt::format(
            "{} lines of {} are {:.3g} s apart, and {} covers {:.3g} s: times are in seconds, are these in milli-, "
            "micro- or "
            "nanoseconds?",
            times[i].size(), names_[i], step[i], names_[0], moved);
    return "";
  }

  /// The longest time of which there is nothing, and how many keyframes all would take.
  std::string too_long(double interval) {
    std::sort(lines_.begin(), lines_.end(), [](const Line& a, const Line& b) { return a.t < b.t; });
    double keyframes = double(measurements_);
    for (std::size_t i = 1; i < lines_.size(); ++i) {
      const Line &from = lines_[i - 1], &to = lines_[i];
      keyframes += (to.t - from.t) / interval;
      if (to.t - from.t > kGap)
        return fmt::format(
            "nothing was recorded between {} s ({}) and {} s ({}), for {} s: is one of them on another clock?",
            text_of(from.t), names_[from.stream], text_of(to.t), names_[to.stream], text_of(to.t - from.t, 0));
    }
    if (keyframes <= kMost) return "";
    return fmt::format("{:.0f} s of data with {} measurements of the target would take {:.0f} keyframes, above {:.0f}",
                       lines_.back().t - lines_.front().t, measurements_, keyframes, kMost);
  }

 private:
  template <class Stream>
  void add(const std::string& name, const Stream& stream, double delay) {
    for (const auto& entry : stream) lines_.push_back({entry.t - delay, names_.size()});
    names_.push_back(name);
  }

  std::vector<std::string> names_;
  std::vector<Line> lines_;
  bool has_motion_ = false;       // the first stream is what the chaser moves by
  std::size_t measurements_ = 0;  // of the target
};

}  // namespace

std::string implausible_times(const Scenario& scenario) {
  Recorded recorded(scenario);
  const double interval = scenario.data.odometry.empty() && scenario.navigation ? scenario.navigation->keyframe_interval
                                                                                : scenario.data.keyframe_interval;
  std::string why = recorded.not_seconds();
  return why.empty() ? recorded.too_long(interval) : why;
}

}  // namespace tandem
