#pragma once

#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <tandem/studies/import/import_map.hpp>
#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// Rows that an import dropped for one reason.
struct DroppedRows {
  std::size_t count = 0;
  std::string example;  ///< the first one: its line, time and value
};

/// The largest angle of an orientation, as the recording has it.
struct LargestAngle {
  std::string quantity, unit;
  double value = 0;  ///< rad

  /// Stores an angle if its excess over the largest angle of its quantity is the largest so far.
  void note(const std::string& name, const std::string& of_unit, double angle);
};

/// Recognises numbers hhmmss among times without a unit: all are times of day, and 59 is followed by 100.
class PackedTimes {
 public:
  void note(double number);
  bool found() const { return possible_ && minutes_ > 0; }

 private:
  bool possible_ = true;
  std::size_t minutes_ = 0;  ///< number of steps from one minute to the next
  double last_ = 0;
};

/// Recognises the days of a spreadsheet (45622.24 is in 2024) among times without a unit: as seconds, their rate is too
/// high.
class SerialDays {
 public:
  void note(double number);
  bool found(double highest_rate) const;

 private:
  bool possible_ = true;
  std::size_t count_ = 0;
  double least_ = 0, most_ = 0;
};

/// The rows of one sensor, as its file in the scenario has them.
///
/// Geographic positions are stored as latitude, longitude and height until finish(), since the origin may be the first
/// fix of another stream.
class ImportedSensor {
 public:
  /// `map` must outlive this object.
  ImportedSensor(const ImportSensor& sensor, const ImportMap& map);
  ImportedSensor(const ImportedSensor&) = delete;

  /// Returns the request for the rows of the stream. This object must outlive it.
  RowRequest request();

  const ImportSensor& sensor() const { return sensor_; }
  std::string file() const;
  /// Returns the number of columns, t included.
  std::size_t width() const { return width_; }
  std::size_t rows() const { return values_.size() / width_; }
  double at(std::size_t row, std::size_t column) const { return values_[row * width_ + column]; }
  double t(std::size_t row) const { return at(row, 0); }
  std::size_t read() const { return read_; }
  const std::map<std::string, DroppedRows>& dropped() const { return dropped_; }
  /// Returns the first names of frames of the used rows, if the rows state them.
  const std::set<std::string>& frames() const { return frames_; }
  /// Returns the standard deviations from the stated variances, or nothing.
  std::vector<double> stated_sigma() const;
  bool is_geographic() const { return geographic_; }
  bool needs_declination() const { return sensor_.magnetic && orientation_ >= 0; }
  std::size_t backwards() const { return backwards_; }  ///< rows earlier than the row before
  /// Returns the largest time without a unit, as recorded; nan if all times have a unit or are texts.
  double unstated_time() const { return unstated_time_; }
  /// Returns a sentence each if an angle of the orientation is beyond a turn, and if times have the form hhmmss or
  /// are days.
  std::vector<std::string> findings() const;

  /// Returns the first position as latitude, longitude and height, before finish().
  std::optional<GeographicPoint> first_fix() const;
  /// Converts geographic positions, turns magnetic headings by the declination [rad], sorts the rows by time, and drops
  /// repeated times.
  void finish(const std::optional<LocalFrame>& frame, double declination);
  /// Drops the rows outside [first, last].
  void trim(double first, double last, const std::string& reason);

 private:
  struct Bound {
    ImportField field;
    std::size_t index = 0;
  };
  std::size_t index_of(const std::string& field);
  Bound bind(const ImportField& field);
  double value(const Bound& bound, const RecordedRow& row) const;
  std::optional<double> time(const RecordedRow& row);
  void add(const RecordedRow& row);
  bool accepted(const RecordedRow& row, double t);
  bool append_part(ImportPart part, const RecordedRow& row, double t);
  bool append_position(const RecordedRow& row, double t);
  bool append_orientation(ImportPart part, const RecordedRow& row, double t);
  bool append_angles(const RecordedRow& row, double t);
  bool append_vector(const char* quantity, const AxisMap& axes, const RecordedRow& row, double t);
  bool append_height(const RecordedRow& row, double t);
  const std::vector<Bound>* bound(std::string_view quantity) const;
  /// Counts a dropped row and returns false. The first one of a reason is stored with `detail`.
  bool drop(const std::string& reason, double t, const std::string& detail = "");
  bool drop(const std::string& reason, double t, double value);
  bool drop_missing(const std::vector<Bound>& fields, double t);
  void drop_without_time();
  double after_midnight(double of_day);
  /// Throws Error if a text is a date whose order is needed and unknown.
  void require_date_order(const Bound& field, std::string_view text) const;

  const ImportSensor& sensor_;
  const ImportMap& map_;
  AxisMap world_, body_;
  std::vector<std::string> fields_;  ///< requested
  std::vector<std::pair<std::string, std::vector<Bound>>> quantities_;
  Bound time_, latency_, week_, date_;
  std::vector<Bound> variances_;
  std::vector<std::pair<ImportCondition, std::size_t>> conditions_;
  std::size_t frame_ = 0;  ///< index of the frame's name
  std::set<std::string> frames_;
  std::size_t width_ = 1;
  bool geographic_ = false;
  const RecordedRow* current_ = nullptr;  ///< during add()
  LargestAngle angles_;
  PackedTimes packed_times_;
  SerialDays serial_days_;
  double unstated_time_ = std::numeric_limits<double>::quiet_NaN();
  double last_of_day_ = 0, midnight_ = 0;  ///< s; see after_midnight()
  int orientation_ = -1;                   ///< first column of an orientation in the world
  std::deque<double> values_;
  std::vector<double> row_;
  std::vector<std::deque<float>> variance_samples_;
  std::size_t read_ = 0, backwards_ = 0;
  std::map<std::string, DroppedRows> dropped_;
};

}  // namespace tandem
