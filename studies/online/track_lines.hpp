#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <tandem/studies/online/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// Returns the heading of the target, clockwise from north (the world's y axis) [rad]: that of its orientation, or else
/// its course. Empty if it stands without an orientation.
std::optional<double> target_heading(const TrackRecord& record);

/// Live table of a track for a terminal: one line per second of data, with a repeated header.
///
/// With a target, the columns are:
///   - range [m], bearing [°] from the chaser's bow (starboard positive) and elevation [°]
///   - speed [m/s] and heading [°], clockwise from north (world y; in NED-FRD x)
///   - σ [m]: root of the summed variances of the relative position
///   - range ± σ [m] of each prediction
/// Without a target: position of the chaser in the scenario's frame, speed, heading and σ of the position. Both end
/// with the number of keyframes in the window, the longest update since the last line, and the health: ok, unconverged,
/// the number of measurements rejected since the last line, or the outputs that are lost or invalid (OutputState).
class TrackLines {
 public:
  /// `target`: whether the table is of a target, else of the chaser alone. `ahead`: prediction horizons [s].
  TrackLines(const Frame& frame, bool target, bool planar, std::vector<double> ahead = {})
      : frame_(frame), target_(target), planar_(planar), ahead_(std::move(ahead)) {}

  /// Returns the table's next line, with a header if one is due; empty in the same second of data as the last line.
  std::string operator()(const TrackRecord& record);

 private:
  std::string header() const;
  std::string health(const TrackRecord& r);
  std::string target_cells(const TrackRecord& r) const;
  std::string prediction_cells(const TrackRecord& r) const;
  std::string chaser_cells(const TrackRecord& r) const;

  Frame frame_;
  bool target_, planar_;
  std::vector<double> ahead_;
  double second_ = -HUGE_VAL;  // second of data of the last line
  double longest_ = 0;         // longest update since the last line [s]
  std::size_t rejected_ = 0;   // number of rejected measurements at the last line
  int lines_ = 0;
};

}  // namespace tandem
