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
#include <tandem/studies/live/bad_spell.hpp>
#include <tandem/studies/live/live_feed.hpp>

namespace tandem {

/// Where a PartialTrack is.
struct PartialPlace {
  std::string run;                        ///< which one; empty: there is none
  std::array<std::uintmax_t, 3> sizes{};  ///< of the files of TrackRows [bytes]
  std::size_t records = 0;
};

/// What another process goes on from: not the estimator's state, but the lines that it depends on (see ReplayLog), out of
/// which it is made again; and what lines do not tell any more: what the motion hypotheses have learned, the streams' clocks
/// and all that is counted.
struct TrackSnapshot {
  std::string scenario;
  std::vector<std::string> streams;  ///< and what each is of: see streams_of()
  double t = 0;                      ///< s, of the newest keyframe
  SE3 chaser{};                      ///< there
  std::optional<Alignment> start{};  ///< of a chaser by its own sensors, where the lines begin; none: at the beginning
  std::vector<FeedLine> lines;
  FeedPlace feed;
  TrackHealth health;
  std::optional<MotionHypotheses::Memory> hypotheses{};
  BadSpell::Memory bad;
  std::size_t came = 0, not_converged = 0;  ///< lines, updates; see Track
  double first = 0, last = 0, seconds = 0;
  RefusedLines::Counts refused;
  PartialPlace partial{};
};

/// Of a scenario, what a snapshot has to agree with: names and kinds of its streams, and the frame.
std::vector<std::string> streams_of(const Scenario& settings, const FeedStreams& streams);

/// A file's bytes, with version and checksum.
std::string bytes_of(const TrackSnapshot& snapshot);
/// Throws Error, a sentence that begins with `file`, when it is damaged, of another version or no snapshot at all.
TrackSnapshot parse_snapshot(std::string_view bytes, const std::string& file);
/// Nothing when there is no such file. Throws Error besides when it is of another scenario than these settings.
std::optional<TrackSnapshot> read_snapshot(const std::filesystem::path& file, const Scenario& settings);

}  // namespace tandem
