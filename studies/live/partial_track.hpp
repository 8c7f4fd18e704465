#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/live/track_rows.hpp>
#include <tandem/studies/live/track_snapshot.hpp>
#include <tandem/studies/support/durable_files.hpp>

namespace tandem {

/// What a track has found so far, on the disk while it goes on: the files of TrackRows in a folder of their own, for whoever
/// comes after a kill. The folder is made with the first update, and removed once all results are where they are to be.
class PartialTrack {
 public:
  /// How long an update may take to the disk, whatever comes or does not, but for the disk itself.
  static constexpr std::chrono::milliseconds period{2000};

  /// For snapshots: the folder keeps the records too, out of which all results are made at the end.
  struct Continues {
    std::optional<PartialPlace> from{};  ///< where the snapshot says that it was
    bool keeps_all = false;              ///< what came after the snapshot does not come again
    std::size_t record_bytes = 0;        ///< see record_bytes()
  };

  /// Goes on in `folder` (see OutputFolder::partial()) where that is what `continues` speaks of; what is there otherwise is
  /// kept under another name, which `tell` is told. Throws Error where another process is writing there, or where there is
  /// what no track has left.
  PartialTrack(std::filesystem::path folder, const TrackRows& rows, DurableFiles& disk,
               const std::optional<Continues>& continues, const std::function<void(const std::string&)>& tell);
  ~PartialTrack();
  PartialTrack(const PartialTrack&) = delete;

  void add(const TrackRecord& record);
  /// For a snapshot of now.
  PartialPlace place() const;
  /// The first so many records of the track, where it goes on, and the file that has them.
  std::size_t earlier() const { return earlier_; }
  std::filesystem::path records_file() const;
  /// Nobody needs it any more.
  void remove();

 private:
  void begin();
  bool go_on(const Continues& continues);
  std::filesystem::path file(std::size_t i) const;

  const std::filesystem::path folder_;
  const TrackRows& rows_;
  DurableFiles& disk_;
  int lock_ = -1;    // descriptor of the folder, once it is there
  std::string run_;  // empty: no records are kept
  std::size_t earlier_ = 0, records_ = 0;
  std::vector<std::size_t> files_;  // those of rows_, and the records
};

}  // namespace tandem
