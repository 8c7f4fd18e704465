#pragma once

#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

/// A defect of a recording that does not prevent estimation, for the report.
struct NavigationFinding {
  enum class Kind {
    not_finite,   ///< Lines with NaN or infinity; dropped.
    backwards,    ///< Lines whose time runs backwards; as few lines as possible are dropped.
    repeated,     ///< Lines that repeat a time; all but the first are dropped.
    saturated,    ///< IMU samples at the end of their range; kept.
    stuck,        ///< A repeated value; kept on IMU axes; other sensors keep only its first line.
    gap,          ///< No IMU samples for longer than max_gap; splits the chain of keyframes.
    silent,       ///< No measurements of another sensor for a long time.
    late,         ///< A sensor starts long after the recording.
    early,        ///< A sensor ends long before the recording.
    empty,        ///< A sensor without measurements.
    upside_down,  ///< The specific force points down at the start.
    above_water,  ///< Most depths are above the world's origin.
    vibration,    ///< Consecutive IMU samples differ by far more than the noise.
  };

  Kind kind;
  std::string sensor;
  std::size_t count = 0;    ///< Number of lines, samples or gaps.
  double from = 0, to = 0;  ///< Time stamps of the first and the last of them [s].
  std::string channel{};    ///< Axis of an IMU, e.g. "specific force x".
  /// Noise densities of the samples for Kind::vibration: m/s² /√Hz and rad/s /√Hz.
  double accelerometer = 0, gyroscope = 0;

  /// Returns a one-sentence description without a final period.
  std::string text() const;
};

/// Removes unusable lines from the data and returns the findings. Afterwards, the times of each sensor increase. Throws
/// Error, with the sensor and the remedy, if data are implausible. Examples are wrong units, specific force without
/// gravity or with the wrong sign, and angular rates that contradict the heading sensor or the specific force.
std::vector<NavigationFinding> check(NavigationData& data);

}  // namespace tandem
