#pragma once

#include <array>
#include <string>
#include <vector>

#include <tandem/studies/live/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// What a row of track.csv is made of; everything in ENU-FLU but for the frame that it is written in.
struct TrackRow {
  const TrackRecord& record;
  const Frame& frame;
};

/// The files of a track that grow with each update, as lines of text, numbers to the last digit: chaser.tum and target.tum,
/// the newest state as filtered, and track.csv, a row an update. The columns are in docs/file_formats.md.
class TrackRows {
 public:
  static constexpr std::array files = {"chaser.tum", "target.tum", "track.csv"};
  using Texts = std::array<std::string, files.size()>;

  /// `ahead`: how far predictions reach [s]; `sensors`: of a record's health. `frame` must live as long.
  TrackRows(const Frame& frame, const std::vector<double>& ahead, const std::vector<std::string>& sensors);

  /// The first line of each file.
  Texts headers() const;
  /// What an update adds to each, with line ends; nothing where there is no target.
  Texts of(const TrackRecord& record) const;
  /// The columns of track.csv, for documents.
  CsvDescription describe() const { return table_.describe(files.back()); }

 private:
  const Frame& frame_;
  CsvTable<TrackRow> table_;
};

/// So many standard deviations of the relative position along the axes of the chaser's body in files [m].
std::optional<Vector<3>> body_sigma(const Frame& frame, const TrackRecord& record, double times);

}  // namespace tandem
