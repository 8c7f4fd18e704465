#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>

#include <tandem/studies/live/track_rows.hpp>
#include <tandem/studies/support/durable_files.hpp>

namespace tandem {

/// What a track has found so far, on the disk while it goes on: the files of TrackRows in a folder of their own, for whoever
/// comes after a kill. The folder is made with the first update, and removed once all results are where they are to be.
class PartialTrack {
 public:
  /// How long an update may take to the disk, whatever comes or does not, but for the disk itself.
  static constexpr std::chrono::milliseconds period{2000};

  /// What is in `folder` (see OutputFolder::partial()) already is kept under another name, which `tell` is told. Throws
  /// Error where another process is writing there.
  PartialTrack(std::filesystem::path folder, const TrackRows& rows, DurableFiles& disk,
               const std::function<void(const std::string&)>& tell);
  ~PartialTrack();
  PartialTrack(const PartialTrack&) = delete;

  void add(const TrackRecord& record);
  /// Nobody needs it any more.
  void remove();

 private:
  void begin();

  const std::filesystem::path folder_;
  const TrackRows& rows_;
  DurableFiles& disk_;
  int lock_ = -1;  // descriptor of the folder, once it is there
  std::array<std::size_t, TrackRows::files.size()> files_{};
};

}  // namespace tandem
