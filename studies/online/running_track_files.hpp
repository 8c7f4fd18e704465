#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/online/partial_track.hpp>
#include <tandem/studies/online/track.hpp>
#include <tandem/studies/support/limited_warnings.hpp>

namespace tandem {

/// The files that are written while tracking: partial results, and the snapshot from which the next run resumes.
/// Failed writes cause warnings but do not end the track.
class RunningTrackFiles {
 public:
  struct Options {
    std::optional<std::filesystem::path> snapshot{};         ///< file; resumes from it if it exists
    std::optional<std::filesystem::path> partial_results{};  ///< folder, see OutputFolder::partial()
    bool keep_all = false;                                   ///< PartialTrack::ResumeOptions::keep_all
    bool announce = true;                                    ///< reports by `warn` that a run is resumed
    std::function<void(const std::string& sentence)> warn;
  };

  /// `ahead`: times of the predictions [s]. Throws Error if the snapshot or the folder of partial results cannot be used.
  RunningTrackFiles(Options options, const Scenario& scenario, const std::vector<double>& ahead);

  /// Returns the state of an earlier run to resume from, if any.
  const std::optional<TrackResumePoint>& before() const { return before_; }

  /// Returns whether results are written to files.
  bool has_results() const { return disk_.has_value(); }

  void add(const TrackRecord& record);
  void add(TrackSnapshot snapshot);

  /// Removes the files after the final results are written. Keeps them for the next run if there is a snapshot and the
  /// data have not ended.
  void remove(bool ended);

 private:
  const Options options_;
  const TrackRows rows_;
  std::optional<TrackResumePoint> before_;
  std::optional<DurableFiles> disk_;
  std::optional<PartialTrack> partial_;
  LimitedWarnings warn_;
};

}  // namespace tandem
