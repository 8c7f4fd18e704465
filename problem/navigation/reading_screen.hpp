#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

/// Reasons to discard the value of a measurement without a comparison with other sensors.
enum class ReadingFault {
  missing,       ///< not finite, or a marker of missing data
  out_of_range,  ///< no sensor of this type reads such values
  zero,          ///< an exact zero far from the values before
  frozen,        ///< the sensor repeats one value
};
inline constexpr int kReadingFaults = 4;

/// Completes a sentence about lines, e.g. "3 lines": "with a repeated value; the sensor may be stuck".
std::string_view text(ReadingFault fault);

/// The numbers of a measurement.
using Reading = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 12, 1>;

/// Judges the measurements of one sensor, other than an IMU, one by one in time order. Batch estimation and online
/// estimation use the same rules.
class ReadingScreen {
 public:
  struct Options {
    double max_magnitude = HUGE_VAL;  ///< largest norm of the first `vector_rows` numbers
    Eigen::Index vector_rows = 3;     ///< numbers that form a vector; 0: none, so there are no zeros
    /// An exact zero vector is accepted if the vector before is at most this long. Negative: no zero is accepted.
    double zero_reach = HUGE_VAL;
    std::size_t frozen_lines = 10;  ///< smallest number of equal lines of a frozen sensor
    double run_ratio = 8;           ///< a longer run than this multiple of the mean run is unusual
    double min_frozen_time = 0;     ///< duration for which a working sensor may repeat a value [s]
    bool may_be_constant = false;   ///< a value that never changes in a whole recording is normal
    std::size_t min_runs = 5;       ///< runs of equal values before one can be unusual
    Eigen::Index axes = 0;          ///< at most 3 numbers, the first ones, of which a single one may also be stuck
  };
  explicit ReadingScreen(const Options& options) : options_(options) {}

  /// Uses the usual runs of equal values and steps of a whole recording instead of those seen so far.
  void set_recording(const std::vector<Reading>& readings);
  /// Returns why the next measurement is implausible, or nothing.
  std::optional<ReadingFault> judge(double t, const Reading& reading);
  /// Returns the number of equal lines, or of lines with a stuck axis, up to the last one.
  std::size_t run() const;

 private:
  /// The present run of equal values.
  struct Run {
    std::size_t lines = 0;
    double begin = 0;                      ///< s
    std::array<double, 3> roots_before{};  ///< Axis::roots at its begin; of the axis itself, before the step into it
    bool lasts(double t, const Options& o) const {  ///< is as long as those of a stuck sensor
      return lines >= o.frozen_lines && t - begin >= o.min_frozen_time;
    }
  };
  struct Axis {
    Run run;
    double roots = 0;  ///< sum of the roots of the steps so far
    // Usual values: of a whole recording, or so far.
    std::size_t runs = 0;
    double usual_roots = 0, smallest = HUGE_VAL;  ///< sum of the roots of the steps; smallest step above zero
  };
  bool is_zero(const Reading& reading) const;
  bool is_frozen(double t) const;
  void add_step(std::size_t axis, double step);
  void follow_axes(double t, const Reading& reading);
  bool is_stuck(std::size_t axis, double t) const;

  Options options_;
  std::optional<Reading> last_;
  double last_length_ = -1;  // of the vector of the last accepted measurement; negative: none yet
  Run run_;
  std::size_t lines_ = 0, runs_ = 0;
  bool recorded_ = false;  // lines_, runs_ and the usual values are those of a whole recording
  std::array<Axis, 3> axes_{};
  std::optional<std::size_t> stuck_;  // axis
};

/// Returns the numbers of a measurement of one of the chaser's own sensors, in ENU-FLU.
Reading reading(EgoSensorType type, const EgoMeasurement& m);
/// Returns the options for one of the chaser's own sensors.
ReadingScreen::Options screen_options(const EgoSensor& sensor);

/// The lines of one sensor that a screen discards for one reason.
struct ScreenedLines {
  std::size_t count = 0;
  double from = 0, to = 0;  ///< stamps of the first and the last [s]
};
using ScreenedByFault = std::array<ScreenedLines, kReadingFaults>;

/// Discards the implausible lines of a recorded sensor; `reading_of(line)` returns the numbers of a line. Discards all
/// repetitions of a frozen sensor, including those before the detection.
template <class Line, class ReadingOf>
ScreenedByFault screen(std::vector<Line>& lines, const ReadingScreen::Options& options, ReadingOf reading_of) {
  std::vector<Reading> readings;
  for (const Line& line : lines) readings.push_back(reading_of(line));
  ReadingScreen screen(options);
  screen.set_recording(readings);
  std::vector<std::optional<ReadingFault>> faults(lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    faults[i] = screen.judge(lines[i].t, readings[i]);
    if (faults[i] != ReadingFault::frozen) continue;
    for (std::size_t k = i + 2 - screen.run(); k < i; ++k) faults[k] = ReadingFault::frozen;  // the first one is kept
  }
  ScreenedByFault found{};
  std::size_t kept = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!faults[i]) {
      if (kept != i) lines[kept] = lines[i];
      ++kept;
      continue;
    }
    ScreenedLines& of = found[std::size_t(*faults[i])];
    if (of.count++ == 0) of.from = lines[i].t;
    of.to = lines[i].t;
  }
  lines.erase(lines.begin() + std::ptrdiff_t(kept), lines.end());
  return found;
}

}  // namespace tandem
