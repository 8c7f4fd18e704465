#pragma once

#include <filesystem>
#include <istream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/problem/stop.hpp>

namespace tandem {

/// What the times of a file may do from line to line.
enum class TimeOrder {
  increasing,
  repeating,  ///< not decrease: a camera may see a target twice in a frame
  any,        ///< of a sensor whose clock is checked later
};

/// How a line of a file is to be read: its columns by name, and what separates them.
class RowFormat {
 public:
  static RowFormat csv(const std::string& columns) { return {columns, ','}; }  ///< e.g. "t,x,y,z"
  static RowFormat tum() { return {"t x y z qx qy qz qw", ' '}; }              ///< separated by any number of blanks

  std::size_t size() const { return names_.size(); }
  const std::string& columns() const { return columns_; }
  bool has_header() const { return separator_ != ' '; }
  /// Whether the line names the columns.
  bool is_header(std::string_view line);
  /// The numbers of a line, all of them finite. Throws Error that says what is wrong with it, but not where it is.
  const std::vector<double>& parse(std::string_view line);
  /// The first field of the line that was parsed last, as it is written there.
  std::string_view first_field() const { return fields_.front(); }

 private:
  RowFormat(const std::string& columns, char separator);
  void take_apart(std::string_view line);

  std::string columns_;
  char separator_;
  std::vector<std::string> names_;
  std::vector<std::string_view> fields_;
  std::vector<std::string> unquoted_;  // what they are of, in a line with quotes
  std::vector<double> values_;
};

/// A file of rows by time, read line by line in the same memory however long it is. Where the format has a header, the
/// first line is that. Empty lines, lines that begin with #, Windows line ends and a byte order mark are tolerated.
/// Throws Error naming file, line and reason.
class RowFile {
 public:
  RowFile(std::filesystem::path file, RowFormat format, TimeOrder order);
  /// The same out of any stream of bytes, which errors call `file`.
  RowFile(std::unique_ptr<std::istream> stream, std::filesystem::path file, RowFormat format, TimeOrder order);
  RowFile(const RowFile&) = delete;

  /// Goes on to the next row, or returns false: there is none.
  bool next();
  const std::vector<double>& row() const { return *row_; }
  int line() const { return line_; }
  const std::filesystem::path& file() const { return file_; }
  const RowFormat& format() const { return format_; }
  /// "folder/usbl.csv:12", to begin an error message with.
  std::string where() const;

 private:
  [[noreturn]] void fail(const std::string& reason) const;
  void check_time();

  std::filesystem::path file_;
  RowFormat format_;
  TimeOrder order_;
  std::unique_ptr<std::istream> stream_;
  bool header_expected_;
  std::string text_;
  const std::vector<double>* row_ = nullptr;
  int line_ = 0, last_line_ = 0;
  double last_t_ = 0;
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

/// All rows that are left of a file. Throws Stopped, "reading FILE: …", when it is to stop.
Table read_table(RowFile& rows, const Stop& stop = {});

/// A whole file of comma-separated values whose first line names the columns, e.g. "t,x,y,z".
Table read_csv(const std::filesystem::path& file, const std::string& header, TimeOrder order = TimeOrder::increasing,
               const Stop& stop = {});

/// A trajectory in the TUM format: t x y z qx qy qz qw, separated by blanks. Lines may repeat a time (see poses()).
Table read_tum(const std::filesystem::path& file, const Stop& stop = {});

/// Columns t x y z qx qy qz qw. A quaternion whose length is within 1e-3 of one is normalised, any other an error. A line
/// that repeats the one before, to 1 mm and 1 mrad, is left out; two different poses of one time are an error.
std::vector<Stamped<SE3>> poses(const Table& table);

}  // namespace tandem
