#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/online/track_rows.hpp>
#include <tandem/studies/online/track_snapshot.hpp>
#include <tandem/studies/support/durable_files.hpp>
#include <tandem/studies/support/file_lock.hpp>

namespace tandem {

/// Intermediate results of a running track on the disk, which survive a kill: the files of TrackRows in a separate
/// folder. The first update creates the folder; remove() deletes it after the final results are written.
class PartialTrack {
 public:
  /// Interval at which DurableFiles writes updates to the disk, also while no input arrives.
  static constexpr std::chrono::milliseconds period{2000};

  /// Options for a track with a snapshot. The folder then also has the records, from which the final results are
  /// computed.
  struct ResumeOptions {
    std::optional<PartialTrackCheckpoint> from{};  ///< state of the folder at the snapshot, if there is one
    bool keep_all = false;         ///< keeps updates after the snapshot, because their input lines do not come again
    std::size_t record_bytes = 0;  ///< see record_bytes()
  };

  /// Continues in `folder` (see OutputFolder::partial()) if it belongs to the checkpoint `resume->from`. Otherwise
  /// renames an existing folder, and reports the new name to `notify`. Throws Error if another process is writing
  /// there, or if the folder has files that are not of a track.
  PartialTrack(std::filesystem::path folder, const TrackRows& rows, DurableFiles& disk,
               const std::optional<ResumeOptions>& resume, const std::function<void(const std::string&)>& notify);
  ~PartialTrack();
  PartialTrack(const PartialTrack&) = delete;

  void add(const TrackRecord& record);
  /// Returns the state of the folder, for a snapshot.
  PartialTrackCheckpoint checkpoint() const;
  /// Returns the number of records that earlier processes wrote; records_file() begins with them.
  std::size_t num_earlier_records() const { return num_earlier_; }
  std::filesystem::path records_file() const;
  /// Deletes the folder.
  void remove();

 private:
  void begin();
  bool resume(const ResumeOptions& options);
  std::filesystem::path file(std::size_t i) const;

  const std::filesystem::path folder_;
  const TrackRows& rows_;
  DurableFiles& disk_;
  std::unique_ptr<FileLock> lock_;  // of the folder, once it exists
  std::string run_;                 // identifies the records file; empty without a snapshot: no records are written
  std::size_t num_earlier_ = 0, num_records_ = 0;
  std::vector<std::size_t> files_;  // handles in disk_: the files of rows_, then the records
};

}  // namespace tandem
