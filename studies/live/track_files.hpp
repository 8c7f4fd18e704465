#pragma once

#include <filesystem>

#include <tandem/studies/live/track_report.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Writes, numbers to the last digit, in the scenario's frame: chaser.tum and target.tum, the newest state at each update, as
/// filtered; track.csv, a row an update; errors.csv, against the truth, of each keyframe when it was the newest; summary.json
/// (see track_json) and, for plots, chaser_truth.tum and target_truth.tum. Throws Error. The columns are in
/// docs/file_formats.md.
void write_track(const Track& track, const TrackSummary& summary, const Scenario& scenario, const LiveOptions& options,
                 const std::filesystem::path& folder);

/// The columns of all files, for documents.
std::vector<CsvDescription> track_file_columns(const LiveOptions& options);

}  // namespace tandem
