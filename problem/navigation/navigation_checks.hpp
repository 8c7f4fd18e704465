#pragma once

#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

/// Something about a recording that an estimate can live with, but whoever reads it should know.
struct NavigationFinding {
  enum class Kind {
    not_finite,  ///< lines with a nan or an infinity: dropped
    backwards,   ///< lines whose time runs backwards: dropped, as few as make the times increase
    repeated,    ///< lines that repeat a time: dropped, all but the first
    saturated,   ///< inertial samples at the end of their range: kept, though they say too little
    stuck,       ///< one value over and over: of an inertial axis kept, of another sensor dropped but for the first
    gap,         ///< nothing for longer than max_gap: the inertial chain is split there
    silent,      ///< another sensor gives nothing for long, in between
    late,
    early,        ///< a sensor begins after, or ends before, the recording does
    empty,        ///< a sensor gives nothing at all
    upside_down,  ///< at the start the specific force points down
    above_water,  ///< depths that are heights
    vibration,    ///< of an inertial sensor: neighbouring samples differ by far more than its noise
  };

  Kind kind;
  std::string sensor;
  std::size_t count = 0;    ///< lines, samples or gaps
  double from = 0, to = 0;  ///< s, as stamped: of the first and the last of them
  std::string channel{};    ///< of an inertial sensor: "specific force x", …
  /// vibration: the densities that the samples show, accelerometer [m/s² /√Hz] and gyroscope [rad/s /√Hz]
  double accelerometer = 0, gyroscope = 0;

  /// One sentence.
  std::string text() const;
};

/// Takes out of the data what no estimate should see, and tells what; afterwards every sensor's times increase. Throws
/// Error, one sentence that names the sensor and says what to do, where the data makes no sense: units that are not
/// m/s², rad/s, m/s or m, an acceleration without gravity or of the wrong sign, a gyroscope whose axes are not the
/// heading's.
std::vector<NavigationFinding> check(NavigationData& data);

}  // namespace tandem
