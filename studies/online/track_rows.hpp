#pragma once

#include <array>
#include <string>
#include <vector>

#include <tandem/studies/online/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Data of a row of track.csv.
struct TrackRow {
  const TrackRecord& record;  ///< in ENU-FLU
  const Frame& frame;         ///< frame of the file
};

/// Formats updates as lines of the files that grow with the track: chaser.tum and target.tum (filtered states) and
/// track.csv. Numbers have full precision. docs/file_formats.md describes the columns.
class TrackRows {
 public:
  static constexpr std::array files = {"chaser.tum", "target.tum", "track.csv"};
  using Texts = std::array<std::string, files.size()>;

  /// `ahead`: prediction horizons [s]; `sensors`: names of the sensors in a record's health. `frame` must outlive the
  /// object.
  TrackRows(const Frame& frame, const std::vector<double>& ahead, const std::vector<std::string>& sensors);

  /// Returns the first line of each file.
  Texts headers() const;
  /// Returns the line of an update in each file, with line ends; empty for target.tum without a target.
  Texts of(const TrackRecord& record) const;
  /// Returns the columns of track.csv, for documentation.
  FileDescription describe() const { return table_.describe(files.back()); }

 private:
  const Frame& frame_;
  CsvTable<TrackRow> table_;
};

/// Returns `factor` times the standard deviation of the relative position along the chaser's axes in `frame` [m]; see
/// reported_sigma(). Nothing without a covariance.
std::optional<Vector<3>> body_sigma(const Frame& frame, const TrackRecord& record, double factor);

}  // namespace tandem
