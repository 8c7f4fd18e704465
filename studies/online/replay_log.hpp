#pragma once

#include <deque>
#include <optional>

#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/studies/online/online_feed.hpp>

namespace tandem {

/// Log of the input from which the present state of a track can be recomputed. It has the lines of the last one to two
/// windows, in order of arrival, and the chaser's state at their start, estimated without them. For the first two
/// windows after the start of a run or a reset of the time, it has all lines and no state.
class ReplayLog {
 public:
  struct Options {
    double window;  ///< window of the track [s]
    double reach;   ///< age at which lines are dropped even if nothing is tracked [s]
    bool odometry;  ///< whether the chaser moves by odometry; no state is needed then
  };
  explicit ReplayLog(const Options& options, const std::optional<Alignment>& start = {});

  void add(const FeedLine& line);
  /// Returns whether the caller should pass the chaser's state at the newest keyframe, at time t [s], to add_state().
  bool wants_state(double t) const { return states_.empty() || t >= states_.back().t + options_.window; }
  void add_state(const Alignment& state);

  const std::deque<FeedLine>& lines() const { return lines_; }
  /// Returns the chaser's state at the start of the lines; nothing if they begin with the run, or with odometry.
  std::optional<Alignment> start() const;

 private:
  Options options_;
  std::deque<FeedLine> lines_;
  std::deque<Alignment> states_;  // at most two; the lines reach back to the first
  bool from_the_beginning_ = true;
};

}  // namespace tandem
