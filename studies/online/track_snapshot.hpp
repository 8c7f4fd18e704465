#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>
#include <tandem/solvers/online/track_health.hpp>
#include <tandem/studies/online/faulty_interval.hpp>
#include <tandem/studies/online/online_feed.hpp>

namespace tandem {

/// State of the folder of a PartialTrack.
struct PartialTrackCheckpoint {
  std::string run;                        ///< name of the run; empty if there is no folder
  std::array<std::uintmax_t, 3> sizes{};  ///< sizes of the files of TrackRows [bytes]
  std::size_t records = 0;                ///< number of records
};

/// Data from which another process can continue a track. It does not have the estimator's state but the input lines
/// from which the state is recomputed (see ReplayLog), and all state that these lines do not determine.
struct TrackSnapshot {
  std::string scenario;
  std::vector<std::string> streams;  ///< see streams_of()
  double t = 0;                      ///< time of the newest keyframe [s]
  SE3 chaser{};                      ///< pose of the chaser at the newest keyframe
  std::optional<Alignment> start{};  ///< chaser's state at the start of the lines; see ReplayLog::start()
  std::vector<FeedLine> lines;
  FeedCheckpoint feed;
  TrackHealth health;
  std::optional<MotionHypotheses::Checkpoint> hypotheses{};
  FaultyIntervalDetector::Checkpoint faulty_intervals;
  std::size_t num_lines = 0, not_converged = 0;  ///< as Track::lines and Track::not_converged
  double first = 0, last = 0, seconds = 0;       ///< as in Track
  RejectedLines::Counts rejected_lines;
  PartialTrackCheckpoint partial{};
};

/// Returns the properties of a scenario that a snapshot must match: its frame, and the names and column counts of its
/// streams.
std::vector<std::string> streams_of(const Scenario& settings, const FeedStreams& streams);

/// Serialises a snapshot, with format version and checksum.
std::string bytes_of(const TrackSnapshot& snapshot);
/// Parses the bytes of a snapshot. Throws Error, with the name `file`, if they are damaged, have another format
/// version, or are not a snapshot.
TrackSnapshot parse_snapshot(std::string_view bytes, const std::string& file);
/// Reads a snapshot file; returns nothing if there is none. Throws Error as parse_snapshot(), and if the snapshot does
/// not match the scenario.
std::optional<TrackSnapshot> read_snapshot(const std::filesystem::path& file, const Scenario& settings);

}  // namespace tandem
