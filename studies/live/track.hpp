#pragma once

#include <atomic>
#include <cmath>
#include <functional>
#include <vector>

#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/studies/live/bad_spell.hpp>
#include <tandem/studies/live/live_feed.hpp>
#include <tandem/studies/live/track_records.hpp>
#include <tandem/studies/live/track_snapshot.hpp>
#include <tandem/studies/navigation/found_constants.hpp>

namespace tandem {

/// How a recording, or what comes in, is tracked line by line.
struct LiveOptions {
  OnlineOptions online{};
  std::vector<double> ahead{5, 10};         ///< s: how far predictions reach
  double until = HUGE_VAL;                  ///< s after the first line
  bool realtime = false;                    ///< each line at its time, by the wall clock
  const std::atomic<bool>* stop = nullptr;  ///< set it to end early
  /// s: after which a spell of updates that do not converge, or in which all that comes is rejected, is a bad one
  double bad_after = 60;
  /// Given what another process could go on from, each so many seconds of the wall clock and at the end; where there is one.
  std::function<void(TrackSnapshot)> on_snapshot{};
  double snapshot_every = 10;
  std::function<void(const std::string&)> tell{};  ///< at once what happens to the track and its streams, a sentence
};

/// What tracking a scenario line by line gave.
struct Track {
  /// `ahead`: how many predictions each record has.
  Track(bool odometry, bool target, std::size_t ahead) : by_odometry(odometry), has_target(target), records(ahead) {}

  bool by_odometry, has_target;   ///< how the chaser moves; whether a sensor observes a target
  std::size_t lines = 0;          ///< that came
  double first = 0, last = 0;     ///< s, of the lines
  double seconds = 0;             ///< that it all took
  std::size_t not_converged = 0;  ///< updates that ended before they had converged
  bool interrupted = false;
  bool ended = false;  ///< the feed has
  RefusedLines refused;
  TrackHealth health;                  ///< at the end
  std::vector<FoundConstant> errors;   ///< that stay, of sensors: as they were measured with last
  std::optional<BadSpell::Spell> bad;  ///< the longest, where there was one
  TrackRecords records;                ///< one an update, in order
};

/// The sensors that a track's health is of, in its order.
std::vector<std::string> watched_sensors(const Scenario& settings);

/// What a track goes on from.
struct TrackBefore {
  TrackSnapshot snapshot;
  std::filesystem::path records{};  ///< bytes_of() those of the track so far, of which the first so many are meant
  std::size_t n = 0;
};

/// Gives an OnlineEstimator every line of the feed; calls `each` after every update. With `before` it goes on, as the track
/// that took the snapshot would have, from that place of the feed (see LiveFeed::go_on_from). Throws Error when the options
/// cannot work, and what the feed throws.
Track track(const Scenario& settings, const LiveOptions& options, LiveFeed& feed,
            const std::function<void(const TrackRecord&)>& each, const std::optional<TrackBefore>& before = {});

}  // namespace tandem
