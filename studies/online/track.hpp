#pragma once

#include <atomic>
#include <cmath>
#include <functional>
#include <vector>

#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/studies/navigation/systematic_error_estimates.hpp>
#include <tandem/studies/online/faulty_interval.hpp>
#include <tandem/studies/online/online_feed.hpp>
#include <tandem/studies/online/track_records.hpp>
#include <tandem/studies/online/track_snapshot.hpp>
#include <tandem/studies/scenario/states_at.hpp>

namespace tandem {

/// Options of online tracking.
struct TrackOptions {
  OnlineOptions online{};
  std::vector<double> ahead{5, 10};         ///< prediction horizons [s]
  double until = HUGE_VAL;                  ///< end of the data used, after the first line [s]
  bool realtime = false;                    ///< processes each line at its time by the wall clock
  const std::atomic<bool>* stop = nullptr;  ///< ends tracking early when it is set
  bool report = false;                      ///< whether to compute TrackRecord::Reported
  bool report_covariance = true;            ///< and its covariance
  std::vector<double> at{};                 ///< times of Track::at [s]
  double faulty_after = 60;                 ///< duration from which an unreliable interval is reported [s]
  /// Receives a snapshot every `snapshot_every` seconds of the wall clock, and at the end.
  std::function<void(TrackSnapshot)> on_snapshot{};
  double snapshot_every = 10;
  std::function<void(const std::string&)> on_notice{};  ///< receives one sentence per event: resets, clock corrections
  /// Receives the sensor and a sentence for each line whose value is missing, implausible or outside the gate.
  std::function<void(const std::string&, const std::string&)> on_rejected_value{};
};

/// Result of online tracking.
struct Track {
  /// `ahead` is the number of predictions of each record.
  Track(bool odometry, bool target, std::size_t ahead) : by_odometry(odometry), has_target(target), records(ahead) {}

  bool by_odometry, has_target;   ///< whether the chaser moves by odometry; whether any sensor observes a target
  std::size_t lines = 0;          ///< number of input lines
  double first = 0, last = 0;     ///< times of the first and the last line [s]
  double seconds = 0;             ///< elapsed time by the wall clock [s]
  std::size_t not_converged = 0;  ///< number of updates that did not converge
  bool interrupted = false;
  bool ended = false;  ///< whether the feed reached its end
  RejectedLines rejected_lines;
  TrackHealth health;                                               ///< at the end
  std::vector<std::vector<std::string>> components;                 ///< names of the components of each of its sensors
  std::vector<SystematicErrorEstimate> errors;                      ///< systematic errors of sensors, at the end
  std::optional<FaultyIntervalDetector::Interval> faulty_interval;  ///< the longest one, if any
  /// States at TrackOptions::at, in their order. Each is that of the first update whose newest keyframe is not earlier.
  std::vector<StateAt> at;
  TrackRecords records;  ///< one per update, in order
};

/// State of an earlier process, from which track() continues.
struct TrackResumePoint {
  TrackSnapshot snapshot;
  std::filesystem::path records{};  ///< file that begins with the `n` records of the track so far, see bytes_of()
  std::size_t n = 0;
};

/// Passes every line of the feed to an OnlineEstimator and calls `each` after every update. With `resume`, the result
/// is that of the earlier track without an interruption; the feed continues at the snapshot's checkpoint. Throws Error
/// if the options are invalid, and any error of the feed.
Track track(const Scenario& settings, const TrackOptions& options, OnlineFeed& feed,
            const std::function<void(const TrackRecord&)>& each, const std::optional<TrackResumePoint>& resume = {});

}  // namespace tandem
