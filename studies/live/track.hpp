#pragma once

#include <atomic>
#include <cmath>
#include <functional>
#include <vector>

#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/studies/live/live_feed.hpp>
#include <tandem/studies/live/track_records.hpp>

namespace tandem {

/// How a recording, or what comes in, is tracked line by line.
struct LiveOptions {
  OnlineOptions online{};
  std::vector<double> ahead{5, 10};         ///< s: how far predictions reach
  double until = HUGE_VAL;                  ///< s after the first line
  bool realtime = false;                    ///< each line at its time, by the wall clock
  const std::atomic<bool>* stop = nullptr;  ///< set it to end early
};

/// What tracking a scenario line by line gave.
struct Track {
  bool by_odometry, has_target;   ///< how the chaser moves; whether a sensor observes a target
  std::size_t lines = 0;          ///< that came
  double first = 0, last = 0;     ///< s, of the lines
  double seconds = 0;             ///< that it all took
  std::size_t not_converged = 0;  ///< updates that ended before they had converged
  bool interrupted = false;
  RefusedLines refused;
  TrackRecords records;  ///< one an update, in order
};

/// Whether the chaser moves by odometry: where there is some, and a target; else by its own sensors.
bool moves_by_odometry(const Scenario& settings);

/// Gives an OnlineEstimator every line of the feed; calls `each` after every update. Throws Error when the options cannot
/// work, and what the feed throws.
Track track(const Scenario& settings, const LiveOptions& options, LiveFeed& feed,
            const std::function<void(const TrackRecord&)>& each);

}  // namespace tandem
