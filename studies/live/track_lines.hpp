#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <tandem/studies/live/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// What a person reads while tracking: one line a second of data, columns aligned, their names above now and then.
///
/// Of the target: range, bearing from the chaser's bow, to starboard positive, elevation; speed and heading, clockwise from
/// north (the world's y; of NED-FRD x); σ, the root of the summed variances of its position relative to the chaser; range
/// and σ of each prediction. Of the chaser alone: position in the scenario's frame, heading, speed and σ of the position.
/// Health: ok; unconverged; so many measurements rejected since the line before; what is lost or invalid (OutputState).
class TrackLines {
 public:
  /// `target`: whether there is one to tell of.
  /// `ahead` [s]: how far predictions reach, each then a column of range ± σ.
  TrackLines(const Frame& frame, bool target, bool planar, std::vector<double> ahead = {})
      : frame_(frame), target_(target), planar_(planar), ahead_(std::move(ahead)) {}

  /// The lines that a record gives rise to, each with its line end; empty within a second of the last one.
  std::string operator()(const TrackRecord& record);

 private:
  std::string header() const;
  std::string health(const TrackRecord& r);
  std::string of_target(const TrackRecord& r) const;
  std::string of_predictions(const TrackRecord& r) const;
  std::string of_chaser(const TrackRecord& r) const;

  Frame frame_;
  bool target_, planar_;
  std::vector<double> ahead_;
  double second_ = -HUGE_VAL;
  double longest_ = 0;        // update since the last line [s]
  std::size_t rejected_ = 0;  // by the last line
  int lines_ = 0;
};

}  // namespace tandem
