#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/problem/tracking.hpp>

namespace tandem {

/// What the times of a file may do from line to line.
enum class TimeOrder {
  increasing,
  repeating,  ///< not decrease: a camera may see a target twice in a frame
  any,        ///< of a sensor whose clock is checked later
};

/// Numbers by time out of a text file: the first column is t [s], in the order that was asked for; every number is
/// finite.
struct Table {
  std::filesystem::path file;
  std::size_t columns;
  std::vector<double> values;  ///< row after row
  std::vector<int> lines;      ///< the line in the file of each row, from 1

  std::size_t rows() const { return lines.size(); }
  const double* row(std::size_t i) const { return values.data() + i * columns; }
  double t(std::size_t i) const { return row(i)[0]; }
  /// "folder/usbl.csv:12", to begin an error message with.
  std::string where(std::size_t i) const;
};

/// A file of comma-separated values whose first line names the columns, e.g. "t,x,y,z". Empty lines, lines
/// that begin with # and Windows line ends are tolerated, here and below. Throws Error naming file, line and
/// reason.
Table read_csv(const std::filesystem::path& file, const std::string& header, TimeOrder order = TimeOrder::increasing);

/// A trajectory in the TUM format: t x y z qx qy qz qw, separated by blanks. Lines may repeat a time (see poses()).
Table read_tum(const std::filesystem::path& file);

/// Columns t x y z qx qy qz qw. A quaternion whose length is within 1e-3 of one is normalised, any other an error. A line
/// that repeats the one before, to 1 mm and 1 mrad, is left out; two different poses of one time are an error.
std::vector<Stamped<SE3>> poses(const Table& table);

}  // namespace tandem
