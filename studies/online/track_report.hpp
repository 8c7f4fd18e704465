#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/online/track.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Quantiles of the update durations [ms].
struct UpdateTimes {
  double median = 0, p99 = 0, max = 0;
};

/// Errors of the predictions with one horizon.
struct AheadErrors {
  double seconds;                   ///< horizon h [s]
  std::optional<MeanStd> nees;      ///< NEES of the predicted relative position, if predictions have covariances
  std::optional<MeanStd> position;  ///< ‖Ĉ(t)⁻¹ t(T̂(t + h)) − C(t)⁻¹ t(T(t + h))‖, predicted at t [m]
};

/// Summary of a track.
struct TrackSummary {
  std::string scenario, frame, model;  ///< names of the scenario and of its frame, description of the model
  std::size_t updates = 0, keyframes = 0;
  UpdateTimes wall, processor;
  std::optional<double> memory_early, memory_end;  ///< resident memory after 10 % of the run, and at its end [MB]
  bool truth = false;                              ///< whether there is truth to compare with
  std::string missing_truth{};                     ///< a sentence if there is none, see missing_truth()
  static constexpr std::size_t all = keyframe_types.size();  ///< index of all keyframes in the next two arrays
  std::array<ErrorSummary, all + 1> errors;  ///< errors of the newest state by keyframe type, and at all keyframes
  std::array<std::optional<MeanStd>, all + 1> nees;  ///< NEES of the relative position, in the same order
  std::vector<AheadErrors> ahead;
  /// Errors of the chaser's newest state [m, deg]; absent if it moves by odometry.
  std::optional<MeanStd> chaser_position, chaser_orientation;
};

/// Errors of the newest state at a new keyframe.
struct TrackError {
  KeyframeError relative;
  std::vector<std::optional<double>> ahead;  ///< position error of each prediction [m]
  std::optional<double> nees;                ///< of the relative position
  std::vector<std::optional<double>> ahead_nees;
  std::optional<double> chaser_position, chaser_orientation;  ///< in the world [m, deg]
};
/// Compares a record with the scenario's truth; errors without truth are absent.
TrackError track_error(const Scenario& scenario, const TrackRecord& record, const TrackOptions& options);

/// Summarises the records of a track and their errors against the scenario's truth.
TrackSummary summarise(const Track& track, const Scenario& scenario, const TrackOptions& options);

/// Judges the innovations of a track against the stated noise. The cost of the report is half the sum of the NIS.
/// `components`: names of the components of each sensor; without them, the report has no statistics of components.
FitReport track_fit(const TrackHealth& health, const std::vector<std::vector<std::string>>& components = {});

/// Returns a report for a terminal.
std::string track_report(const Track& track, const TrackSummary& summary);
/// Returns the contents of summary.json, without fields that are not available.
std::string track_json(const Track& track, const TrackSummary& summary);
/// Returns the same as one line, with a line end.
std::string track_json_summary_line(const Track& track, const TrackSummary& summary);
/// Returns the keys of summary.json.
FileDescription track_json_keys();

}  // namespace tandem
