#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/live/track.hpp>

namespace tandem {

/// Quantiles of how long updates took [ms].
struct UpdateTimes {
  double median = 0, p99 = 0, most = 0;
};

/// Errors of a prediction some seconds ahead.
struct AheadErrors {
  double seconds;
  std::optional<MeanStd> nees;      ///< of the same, where predictions have covariances
  std::optional<MeanStd> position;  ///< ‖Ĉ(t)⁻¹ t(T̂(t + h)) − C(t)⁻¹ t(T(t + h))‖, predicted at t [m]
};

/// What is to be told of a run.
struct TrackSummary {
  std::string scenario, frame, model;  ///< the frame of files; the model in words
  std::size_t updates = 0, keyframes = 0;
  UpdateTimes wall, processor;
  std::optional<double> memory_early, memory_end;  ///< MB: after a tenth of the run, and at its end
  bool truth = false;
  std::array<ErrorSummary, 4> errors;          ///< of the newest state: at usbl, optical, gated keyframes, and all
  std::array<std::optional<MeanStd>, 4> nees;  ///< likewise, eᵀ P⁻¹ e of the relative position
  std::vector<AheadErrors> ahead;
  std::optional<MeanStd> chaser_position,
      chaser_orientation;  ///< of the newest state [m, deg]; by its own sensors only
};

/// How far the newest state was from the truth when a keyframe had just joined: fields as in KeyframeError, and of the
/// predictions [m] and the chaser [m, deg].
struct TrackError {
  KeyframeError relative;
  std::vector<std::optional<double>> ahead;
  std::optional<double> nees;
  std::vector<std::optional<double>> ahead_nees;
  std::optional<double> chaser_position, chaser_orientation;
};
TrackError track_error(const Scenario& scenario, const TrackRecord& record, const LiveOptions& options);

/// Goes through a run's records; `scenario` has the truth, if there is one.
TrackSummary summarise(const Track& track, const Scenario& scenario, const LiveOptions& options);

/// For a terminal.
std::string track_report(const Track& track, const TrackSummary& summary);
/// summary.json; fields that truth or system do not give are left out.
std::string track_json(const Track& track, const TrackSummary& summary);

}  // namespace tandem
