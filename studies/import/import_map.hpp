#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tandem/studies/import/geodesy.hpp>
#include <tandem/studies/import/import_axes.hpp>
#include <tandem/studies/import/import_types.hpp>
#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/recording/recorded_units.hpp>
#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// A field of a stream with its unit: value in SI units = factor · field, or a constant.
struct ImportField {
  std::string field;  ///< empty for a constant
  double factor = 1;
  double constant = 0;
  bool degrees_and_minutes = false;  ///< whether values have the form dddmm.mmmm, as in NMEA
  bool time_of_day = false;          ///< whether values have the form hhmmss.ss
  std::string unit{};                ///< name of the unit, for the report; empty for SI units without a statement
};

/// A condition on rows: FIELD OP VALUE. Rows that do not meet it are dropped.
struct ImportCondition {
  enum class Op { equal, not_equal, less, less_equal, greater, greater_equal };
  std::string field;
  Op op;
  std::string text;  ///< value as written
  double number;     ///< nan if the value is a text
};

/// Time base of a stream.
struct ImportTime {
  bool receive = false;  ///< whether the receive time is used instead of a field
  ImportField field{};
  std::string week{};        ///< Field with the GPS week, if `field` is the time of the week.
  double date = 0;           ///< s; midnight that a time of day is relative to.
  std::string date_field{};  ///< Field with the date of each row, instead of `date`.
  DateOrder date_order = DateOrder::unknown;
  bool gps = false;  ///< Whether the epoch is GPS (1980), not Unix (1970).
  double leap_seconds = kLeapSeconds;
  double offset = 0;  ///< s, added
};

/// An entry that scenario.yaml receives.
struct ImportSetting {
  std::string key, value;
  std::string place;  ///< "map.yaml:12: SENSOR", for messages
};

/// A sensor to import: the stream, its fields, and the settings that scenario.yaml receives.
struct ImportSensor {
  std::string name;
  std::string place;  ///< "map.yaml:12", or "topic" for rules without a map
  const ImportType* type = nullptr;
  std::string stream;
  ImportTime time{};
  std::optional<ImportField> latency{};
  std::vector<std::pair<std::string, std::vector<ImportField>>> fields{};  ///< by quantity
  std::string euler_order{};                                               ///< "zyx" of `euler`
  std::vector<ImportCondition> conditions{};
  std::vector<ImportField> variances{};  ///< give sigma, if `sigma` is not in `settings`
  ImportAxes axes{};
  bool magnetic = false;                  ///< headings refer to magnetic north
  std::vector<ImportSetting> settings{};  ///< keys and values for scenario.yaml
  std::string frame_field{};  ///< field with the frame; rows in frames of the world are dropped; empty if any is right
  std::string time_note{};    ///< how the times follow, if the recording does not state them
  bool assumed = false;       ///< whether a rule has made it, without a map
  bool fields_by_rule = false;  ///< whether the fields are those of a known message
  bool axes_stated = false, time_stated = false, north_stated = false;  ///< by the map or a known message

  /// Returns the fields of a quantity, or null.
  const std::vector<ImportField>* find(std::string_view quantity) const;
};

/// Returns whether a value meets a condition.
bool is_met(const ImportCondition& condition, const RecordedValue& value);
/// Returns "FIELD OP VALUE".
std::string condition_text(const ImportCondition& condition);

/// A whole import: sensors and the settings of the scenario.
struct ImportMap {
  std::string name;
  bool frame_stated = false;
  bool ned = false;  ///< whether the axes of the written scenario are NED-FRD, not ENU-FLU
  std::optional<GeographicPoint> origin{};
  std::optional<double> declination{};  ///< rad, east positive
  std::filesystem::path magnetic_model{};
  double density = 1025, atmosphere = 101325;  ///< kg/m³, Pa
  bool water_given = false;
  std::vector<ImportSensor> sensors{};
  std::vector<ImportSetting> settings{};  ///< further keys of scenario.yaml
  std::vector<ImportSetting> noise{};
  std::vector<std::string> unused{};  ///< streams that no rule uses, with the reason
};

/// Returns whether settings have a key.
bool has_setting(const std::vector<ImportSetting>& settings, std::string_view key);

/// Reads the tables' settings from a map file. They must be known before the recording is opened.
TableSettings read_table_settings(const std::filesystem::path& map);

/// Reads a map file for a recording. Throws Error with file and line on unknown keys, streams, fields and units, and on
/// statements that are ambiguous.
ImportMap read_import_map(const std::filesystem::path& map, const Recording& recording);

/// Returns the map of a recording with known messages only. Throws Error if there is none.
ImportMap known_import_map(const Recording& recording);

}  // namespace tandem
