#pragma once

#include <deque>
#include <optional>

#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/studies/live/live_feed.hpp>

namespace tandem {

/// What a track of now depends on, to make it again from: the lines of the last one to two windows, in their order of arrival,
/// and the chaser's state where they begin, which is as it was then: it knows nothing of what they tell. From the beginning
/// of a run, or of time, it is all lines.
class ReplayLog {
 public:
  struct Options {
    double window;  ///< s, that a track remembers
    double reach;   ///< s: older lines are let go also while nothing is tracked
    bool odometry;  ///< the chaser moves by it: begins where that has it, and needs no state
  };
  explicit ReplayLog(const Options& options, const std::optional<Alignment>& start = {});

  void add(const FeedLine& line);
  /// Whether the chaser's state at t [s] is to be noted, of the newest keyframe.
  bool wants_state(double t) const { return states_.empty() || t >= states_.back().t + options_.window; }
  void note(const Alignment& state);

  const std::deque<FeedLine>& lines() const { return lines_; }
  /// The chaser where the lines begin; none from the beginning, or by odometry.
  std::optional<Alignment> start() const;

 private:
  Options options_;
  std::deque<FeedLine> lines_;
  std::deque<Alignment> states_;  // two at most; the lines go back to the first
  bool from_the_beginning_ = true;
};

}  // namespace tandem
