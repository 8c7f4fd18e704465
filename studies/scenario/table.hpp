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

/// The required order of the times in a file.
enum class TimeOrder {
  increasing,
  repeating,  ///< non-decreasing: a camera may detect a target twice in a frame
  any,        ///< not checked here; the caller checks it later
};

/// Format of the lines of a file: column names and separator.
class RowFormat {
 public:
  static RowFormat csv(const std::string& columns) { return {columns, ','}; }  ///< e.g. "t,x,y,z"
  static RowFormat tum() { return {"t x y z qx qy qz qw", ' '}; }              ///< any number of blanks as separator

  /// Returns this format with missing values: all columns but the first may be empty or NaN, and are then NaN.
  RowFormat with_missing_values() const {
    RowFormat format = *this;
    format.missing_values_ = true;
    return format;
  }

  std::size_t size() const { return names_.size(); }
  const std::string& columns() const { return columns_; }
  bool has_header() const { return separator_ != ' '; }
  /// Returns whether the line contains the column names.
  bool is_header(std::string_view line);
  /// Returns the numbers of a line. Throws Error, without the location, if there are not as many finite numbers as
  /// columns.
  const std::vector<double>& parse(std::string_view line);
  /// Returns the text of the first field of the line that was parsed last.
  std::string_view first_field() const { return fields_.front(); }

 private:
  RowFormat(const std::string& columns, char separator);
  void split_fields(std::string_view line);

  std::string columns_;
  char separator_;
  bool missing_values_ = false;
  std::vector<std::string> names_;
  std::vector<std::string_view> fields_;
  std::vector<std::string> unquoted_;  // storage of the fields of a line with quotes
  std::vector<double> values_;
};

/// A file with one row of numbers per line, time first. It is read line by line with constant memory. If the format has
/// a header, the first line must be that header. Skips empty lines and lines that start with #; accepts Windows line
/// ends and a byte order mark. The members throw Error with file, line and reason.
class RowFile {
 public:
  RowFile(std::filesystem::path file, RowFormat format, TimeOrder order);
  /// Reads from a stream instead; `file` is its name in error messages.
  RowFile(std::unique_ptr<std::istream> stream, std::filesystem::path file, RowFormat format, TimeOrder order);
  RowFile(const RowFile&) = delete;

  /// Reads the next row. Returns false at the end of the file.
  bool next();
  const std::vector<double>& row() const { return *row_; }
  int line() const { return line_; }
  const std::filesystem::path& file() const { return file_; }
  const RowFormat& format() const { return format_; }
  /// Returns the location for error messages, e.g. "folder/usbl.csv:12".
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

/// All rows of a text file. The first column is t [s]; all numbers are finite or, if the format has missing values,
/// NaN.
struct Table {
  std::filesystem::path file;
  std::size_t columns;
  std::vector<double> values;  ///< row after row
  std::vector<int> lines;      ///< line number of each row in the file, from 1

  std::size_t rows() const { return lines.size(); }
  const double* row(std::size_t i) const { return values.data() + i * columns; }
  double t(std::size_t i) const { return row(i)[0]; }
  /// Returns the location of row i for error messages, e.g. "folder/usbl.csv:12".
  std::string where(std::size_t i) const;
};

/// Reads the remaining rows of a file. Throws Stopped with the message "reading FILE: …" if `stop` is reached.
Table read_table(RowFile& rows, const Stop& stop = {});

/// Reads a CSV file with the given header, e.g. "t,x,y,z".
Table read_csv(const std::filesystem::path& file, const std::string& header, TimeOrder order = TimeOrder::increasing,
               const Stop& stop = {});
/// Reads the file of a sensor, a CSV file with missing values (see RowFormat::with_missing_values()).
Table read_sensor_rows(const std::filesystem::path& file, const std::string& header, TimeOrder order,
                       const Stop& stop = {});

/// Reads a trajectory in the TUM format: t x y z qx qy qz qw, separated by blanks. Times may repeat; see poses().
Table read_tum(const std::filesystem::path& file, const Stop& stop = {});
/// Reads an odometry in the TUM format with missing values.
Table read_odometry(const std::filesystem::path& file, const Stop& stop = {});

/// Returns the poses of a table with the columns t x y z qx qy qz qw. Normalises the quaternions. Skips a repeated pose
/// (same time, within 1 mm and 1 mrad). Throws Error on different poses at the same time, and on a quaternion whose
/// norm differs from 1 by more than 1e-3.
std::vector<Stamped<SE3>> poses(const Table& table);

}  // namespace tandem
