#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/metrics.hpp>
#include <tandem/studies/track.hpp>

namespace tandem {

/// Quantiles of how long updates took [ms].
struct UpdateTimes {
  double median = 0, p99 = 0, most = 0;
};

/// Errors of a prediction some seconds ahead.
struct AheadErrors {
  double seconds;
  std::optional<MeanStd> position;  ///< ‖Ĉ(t)⁻¹ t(T̂(t + h)) − C(t)⁻¹ t(T(t + h))‖, predicted at t [m]
};

/// What is to be told of a run.
struct TrackSummary {
  std::string scenario, model;  ///< the model in words
  std::size_t updates = 0, keyframes = 0;
  UpdateTimes wall, processor;
  std::optional<double> memory_early, memory_end;  ///< MB: after a tenth of the run, and at its end
  bool truth = false;
  std::array<ErrorSummary, 4> errors;  ///< of the newest state: at usbl, optical, gated keyframes, and all
  std::vector<AheadErrors> ahead;
  std::optional<MeanStd> chaser_position, chaser_angle;  ///< of the newest state [m, deg]; by its own sensors only
};

/// How far the newest state was from the truth when a keyframe had just joined: fields as in KeyframeError, and of the
/// predictions [m] and the chaser [m, deg].
struct TrackError {
  KeyframeError relative;
  std::vector<std::optional<double>> ahead;
  std::optional<double> chaser_position, chaser_angle;
};
TrackError track_error(const Scenario& scenario, const TrackRecord& record, const TrackOptions& options);

/// Goes through a run's records; `scenario` has the truth, if there is one.
TrackSummary summarise(const Track& track, const Scenario& scenario, const TrackOptions& options);

/// For a terminal.
std::string track_report(const Track& track, const TrackSummary& summary);
/// summary.json; fields that truth or system do not give are left out.
std::string track_json(const Track& track, const TrackSummary& summary);

/// Writes, numbers to the last digit, in the scenario's frame:
///
///     chaser.tum, target.tum  the newest state at each update, as filtered
///     track.csv               t, type, update times [ms], position of the target in the chaser's body and its standard
///                             deviations, where it is predicted to be some seconds ahead
///     errors.csv              against the truth, of each keyframe when it was the newest
///     summary.json            see track_json
///
/// Throws Error.
void write_track(const Track& track, const TrackSummary& summary, const Scenario& scenario, const TrackOptions& options,
                 const std::filesystem::path& folder);

}  // namespace tandem
