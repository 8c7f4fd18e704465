#pragma once

#include <filesystem>

#include <tandem/studies/live/track_report.hpp>

namespace tandem {

/// Writes, numbers to the last digit, in the scenario's frame:
///
///     chaser.tum, target.tum  the newest state at each update, as filtered
///     track.csv               t, type, update times [ms], position of the target in the chaser's body and its standard
///                             deviations, where it is predicted to be some seconds ahead
///     errors.csv              against the truth, of each keyframe when it was the newest
///     summary.json            see track_json
///
/// Throws Error.
void write_track(const Track& track, const TrackSummary& summary, const Scenario& scenario, const LiveOptions& options,
                 const std::filesystem::path& folder);

}  // namespace tandem
