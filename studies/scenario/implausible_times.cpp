#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include <tandem/studies/scenario/implausible_times.hpp>

namespace tandem {
namespace {

constexpr double kStep = 1000;     // s between lines of the densest stream: no recording is so slow
constexpr double kGap = 3600;      // s without a line of any stream
constexpr double kMost = 200'000;  // keyframes

struct Line {
  double t;  // s, when it was valid
  std::size_t stream;
};

/// What was recorded, by stream.
class Recorded {
 public:
  explicit Recorded(const Scenario& scenario) {
    const TrackingData& data = scenario.data;
    if (!data.odometry.empty()) add("the odometry", data.odometry, 0);
    for (const TargetSensor& sensor : data.sensors) add(sensor.name, sensor.measurements, sensor.delay);
    measurements_ = lines_.size() - data.odometry.size();
    if (data.odometry.empty() && scenario.navigation) {
      const NavigationData& own = *scenario.navigation;
      if (own.imu) add("the imu", own.imu->samples, 0);
      for (const EgoSensor& sensor : own.sensors) add(sensor.name, sensor.measurements, sensor.delay);
    }
  }

  /// Stamps that are too far apart.
  std::string not_seconds() const {
    std::vector<std::size_t> sizes(names_.size(), 0);
    for (const Line& line : lines_) ++sizes[line.stream];
    if (sizes.empty()) return "";
    const auto densest = std::size_t(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
    std::vector<double> times, steps;
    for (const Line& line : lines_)
      if (line.stream == densest) times.push_back(line.t);
    std::sort(times.begin(), times.end());
    for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
    if (steps.empty()) return "";
    const auto middle = steps.begin() + std::ptrdiff_t(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    if (*middle < kStep) return "";
    return fmt::format("lines of {} are {:.3g} s apart: times are in seconds, are these in nano- or microseconds?",
                       names_[densest], *middle);
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
            "nothing was recorded between {:.3f} s ({}) and {:.3f} s ({}), for {:.0f} s: is one of them on another "
            "clock?",
            from.t, names_[from.stream], to.t, names_[to.stream], to.t - from.t);
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
