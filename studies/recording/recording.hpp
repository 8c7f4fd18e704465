#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/studies/recording/recorded_time.hpp>

namespace tandem {

/// A value of a recorded row: a number, or a text that is not one.
struct RecordedValue {
  double number = std::numeric_limits<double>::quiet_NaN();
  std::string_view text{};  ///< valid during the call of the row function; empty for numbers
};

/// A field of a stream.
struct RecordedField {
  std::string name;    ///< path in the message: "pose.pose.position.x", or the name of a column
  std::string unit{};  ///< unit that the recording states; empty if it states none. find_unit() may not know it.
};

/// A stream of a recording: a topic, a kind of message of a log, or a table.
struct RecordedStream {
  std::string name;
  std::string type{};  ///< message type, for example "sensor_msgs/Imu"; empty if the format has none
  std::vector<RecordedField> fields{};
  std::string time_field{};  ///< field with the time of validity; empty if rows only have a receive time
  std::string date_field{};  ///< field with the date, if `time_field` is a time of day
  DateOrder date_order = DateOrder::unknown;  ///< of dates like 05/06/2024
  std::size_t rows = 0;
  double first = std::numeric_limits<double>::quiet_NaN();  ///< time of the first and the last row [s]
  double last = std::numeric_limits<double>::quiet_NaN();
  std::string unreadable{};  ///< why the rows cannot be decoded; empty if they can
  std::string time_note{};   ///< how the times of rows follow, if the recording does not state them
};

/// A row of a stream. The values are in the order of the requested fields.
struct RecordedRow {
  double received;  ///< receive time [s]; nan if the format has none
  std::span<const RecordedValue> values;
  std::size_t line = 0;  ///< line of the file, counted from 1; 0 if the format has no lines
};

/// A request for rows: the fields of one stream and the function that receives them.
struct RowRequest {
  std::string stream;
  std::vector<std::string> fields;
  std::function<void(const RecordedRow&)> row;
};

/// Field name that every stream has: the receive time [s].
inline constexpr const char* kReceiveTime = "receive_time";

/// A recording of any format. Rows are read one by one, so memory does not grow with the file.
class Recording {
 public:
  virtual ~Recording() = default;
  Recording() = default;
  Recording(const Recording&) = delete;

  const std::filesystem::path& file() const { return file_; }
  const std::string& format() const { return format_; }
  const std::vector<RecordedStream>& streams() const { return streams_; }
  /// Returns the stream of this name, or nothing.
  const RecordedStream* find(std::string_view name) const;
  /// Returns one sentence for each defect of the file that did not prevent reading, with the byte offset.
  const std::vector<std::string>& defects() const { return defects_; }

  /// Reads the requested rows in the order of the file. `stop` is called now and then and may throw. Throws Error if a
  /// requested field is not in its stream.
  virtual void read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) = 0;

 protected:
  std::filesystem::path file_;
  std::string format_;
  std::vector<RecordedStream> streams_;
  std::vector<std::string> defects_;

  void add_defect(std::string sentence);
};

/// Format of text tables (CSV). Values that are not set are detected from the first lines.
struct TableSettings {
  std::optional<char> delimiter{};  ///< ' ' means any number of blanks
  std::optional<bool> header{};     ///< whether the first line has the column names
  std::optional<bool> decimal_comma{};
  std::string comment = "#%";          ///< lines that begin with one of these are skipped, unless they name the columns
  std::vector<std::string> missing{};  ///< texts or numbers that mean a missing value; -9999 also means -9999.0
  std::size_t skip = 0;                ///< lines before the table
  DateOrder date_order = DateOrder::unknown;
};

/// Opens a recording of any known format. A folder is a ROS 2 bag or a set of tables; its streams are those of all
/// files. Throws Error if the file is missing, or if its format is unknown.
std::unique_ptr<Recording> open_recording(const std::filesystem::path& path, const TableSettings& tables = {});

/// Returns the field of this name, or null. Indices in brackets may have any value ("poses[3].x" for "poses[0].x"). The
/// column "x [m]" of a table is also found as "x", if no other column is. A number selects a column, counted from 1.
const RecordedField* find_field(const RecordedStream& stream, const std::string& name);

/// Returns the index of each field of a request in the stream. Throws Error, with a similar name, if one is missing.
std::vector<std::size_t> field_indices(const RecordedStream& stream, const std::vector<std::string>& fields);

/// Returns the sentence "STREAM has no field 'x'; did you mean y? (fields: …)".
std::string unknown_field(const RecordedStream& stream, const std::string& field);

}  // namespace tandem
