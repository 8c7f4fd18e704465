#pragma once

#include <filesystem>

#include <tandem/studies/online/track_report.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes the files of a track, in the scenario's frame, with full precision. Throws Error if a file cannot be written.
///   chaser.tum, target.tum               filtered states: the newest state at each update
///   track.csv                            one row per update
///   errors.csv                           errors of the newest state at each keyframe
///   summary.json                         see track_json()
///   chaser_truth.tum, target_truth.tum   true poses, if there is truth
/// docs/file_formats.md describes the columns.
void write_track(const Track& track, const TrackSummary& summary, const Scenario& scenario, const TrackOptions& options,
                 const std::filesystem::path& folder);

/// Returns the columns of all CSV files, for documentation.
std::vector<FileDescription> track_file_columns(const TrackOptions& options);

}  // namespace tandem
