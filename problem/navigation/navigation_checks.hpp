#pragma once

#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

/// A defect of a recording that does not prevent estimation, for the report.
struct NavigationFinding {
  enum class Kind {
    not_finite,   ///< lines with NaN, infinity or a marker of missing data; dropped
    implausible,  ///< lines with implausible values (ReadingScreen, ImuScreen); discarded
    jump,         ///< odometry that jumps to a new origin; continued from the expected pose
    rejected,     ///< measurements that contradict the others; dropped
    backwards,    ///< lines whose time runs backwards; drops the fewest lines that make the times increase
    repeated,     ///< lines that repeat a time; all but the first are dropped
    saturated,    ///< IMU samples at the end of their range; kept
    stuck,        ///< a repeated value of one axis of an IMU; kept
    gap,          ///< no IMU samples for longer than max_gap; splits the chain of keyframes
    silent,       ///< no measurements of another sensor for a long time
    late,         ///< a sensor starts long after the recording
    early,        ///< a sensor ends long before the recording
    empty,        ///< a sensor without measurements
    upside_down,  ///< the specific force points down at the start
    above_water,  ///< most depths are above the world's origin
    vibration,    ///< consecutive IMU samples differ by far more than the noise
  };

  Kind kind;
  std::string sensor;
  std::size_t count = 0;    ///< number of lines, samples or gaps
  double from = 0, to = 0;  ///< time stamps of the first and the last of them [s]
  /// Axis of an IMU, e.g. "specific force x". For Kind::implausible and Kind::rejected, the end of the sentence of
  /// text().
  std::string channel{};
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
